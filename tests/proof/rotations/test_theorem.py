"""The hypotheses of almost every start on SO(3): what holds, and what must be refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.rotations import attitude, config_of, four_mounts, held, tie, traced, zero_of_chart

from rbstab.mechanics.attitude import rotation
from rbstab.proof.enclosures.taylor import value_at
from rbstab.proof.rotations.energy import ENTRIES, NO_POSITION, NotOnRotationsError
from rbstab.proof.rotations.lists import rest_rotations
from rbstab.proof.rotations.states import Rotations, against_morse
from rbstab.proof.rotations.symmetries import symmetries
from rbstab.proof.rotations.theorem import (
    why_just_taut,
    why_not_almost_every_start,
    why_not_damped_on_rotations,
)

UP = {"tie": tie([0, 0, 0]), "up": attitude([1, 1.2, 1.5])}
LIGAMENT = {"kind": "ligament", "point": [0, 0, 0.1], "anchor": [0, 0, 1], "stiffness": 50} | {
    "slack_length": 0.5,
    "toe_strain": 0.05,
}
SPRING = {"kind": "spring", "stiffness": 50, "rest_length": 0.4}


def why_of(config):
    _, energy, exact = traced(config)
    return why_not_almost_every_start(energy, rest_rotations(energy, 20_000), exact)


def test_all_hypotheses_of_a_simple_body_hold():
    assert why_of(config_of(UP)) == ""


@pytest.mark.parametrize(
    ("config", "why"),
    [
        (held({}, {"K_r": [1, 1, 1]}), "K_r acts on Euler angles"),
        # A ligament alone holds no position: it is slack in a part of space.
        (config_of({"up": attitude([1, 1, 1]), "l": LIGAMENT}), NO_POSITION),
        (config_of(UP | {"s": SPRING | {"point": [0, 0, 0.1], "anchor": [0, 0, 1]}}), "not convex"),
        (
            held({"s": SPRING | {"point": [0.05, -0.02, 0.3], "anchor": [0.55, -0.02, -0.2]}}),
            "length",
        ),
        (
            config_of(UP | {"g": {"kind": "guard", "method": "barrier", "stiffness": 1}}),
            "reads Euler angles",
        ),
    ],
)
def test_an_energy_that_is_not_one_of_the_rotation_is_refused(config, why):
    with pytest.raises(NotOnRotationsError, match=why):
        traced(config)


def test_an_element_that_reads_an_angle_is_noticed(monkeypatch):
    from rbstab.elements.attitude_spring import AttitudeSpring

    plain = AttitudeSpring.dissipated
    monkeypatch.setattr(
        AttitudeSpring, "dissipated", lambda self, m, states: plain(self, m, states) + m.Theta[0]
    )
    with pytest.raises(NotOnRotationsError, match="up reads Euler angles"):
        traced(config_of(UP))


A, B, ON_LINE = [0.2, 0.1, 0], [-0.2, 0.1, 0], [-0.4, -0.2, 0]


@pytest.mark.parametrize(
    ("config", "damped"),
    [
        (config_of({"a": tie(A), "up": attitude([1, 2, 3])}), True),  # (i)
        (four_mounts(), True),  # (ii)
        (config_of({"a": tie(A), "b": tie(B)}), True),  # (iii)
        (config_of({"a": tie(A), "b": tie(ON_LINE)}), False),  # G on their line
        (
            config_of(
                {
                    "a": tie(A),
                    "b": tie(B),
                    "s": SPRING
                    | {"rest_length": 0}
                    | {"point": [0, 0, 0.1], "anchor": [0, 0, 0.1]},
                }
            ),
            False,  # its force is not constant
        ),
        (
            config_of({"a": tie(A), "b": tie(B)}, controller={"variant": "free", "L_r": [0, 0, 1]}),
            True,
        ),
    ],
)
def test_which_bodies_lose_energy_in_every_motion(config, damped):
    why = why_not_damped_on_rotations(traced(config).exact)
    assert (why is None) == damped


@pytest.mark.parametrize(
    ("slack", "damping", "index", "may"),
    [(0.4, 2, 1, True), (0.4, 0, 1, False), (0.4, 2, 0, False), (0.9, 2, 1, False)],
)
def test_a_damped_ligament_that_is_just_taut_at_a_saddle(slack, damping, index, may):
    # At half a turn about z its length is 0.4 m: from (-0.3, 0, 0) to (0.1, 0, 0).
    line = {"kind": "ligament", "point": [0.3, 0, 0], "anchor": [0.1, 0, 0], "stiffness": 50}
    line |= {"slack_length": slack, "toe_strain": 0.05, "damping": damping}
    at_centre = {"contact_point": [0, 0, 0], "mass": 2, "inertia": [0.02, 0.03, 0.025]}
    controller = {"variant": "permanent", "L_r": [0.1, 0.1, 0.1]}
    elements = {"up": attitude([1, 1.2, 1.5]), "line": line}
    energy = traced(config_of(elements, body=at_centre, controller=controller)).energy
    rotations = Rotations((zero_of_chart(3, [0, 0, 0], index=index),), 0)
    assert bool(list(why_just_taut(energy, rotations))) == may


@pytest.mark.parametrize(
    ("indices", "fits"),
    [
        ([0, 1, 2, 3], True),
        ([0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3], True),
        ([0], False),
        ([0, 0, 1, 2, 3], False),
        ([0, 1, 1, 2, 3], False),
    ],
)
def test_morse_on_rotations(indices, fits):
    assert (against_morse(indices) == "") == fits


def test_symmetries_leave_the_energy_as_it_is_and_others_do_not():
    weight = {"gravity": [0, 0, -9.81]}
    # The ties are alike about z, so the body may be turned about z with its frame.
    _, energy, _ = traced(
        config_of({"a": tie([0, 0, 0.2], K=(50, 50, 80)), "up": attitude([1, 1, 3])}, **weight)
    )
    (turn,) = symmetries(energy.U)
    assert turn.words == "the inertial axis z and at once about the body axis z"
    u, v = (np.array(w, dtype=float) for w in turn)

    def U(A):
        return value_at(energy.U, np.concatenate([np.zeros(ENTRIES), A.ravel()]))

    start = rotation(np.array([0.3, 0.7, -1.1]))
    moved = (
        Rotation.from_rotvec(0.8 * u).as_matrix()
        @ start
        @ Rotation.from_rotvec(0.8 * v).as_matrix()
    )
    other = Rotation.from_rotvec(0.8 * u).as_matrix() @ start
    assert U(moved) == pytest.approx(U(start), rel=1e-12)
    assert abs(U(other) - U(start)) > 1e-2
    _, energy, _ = traced(config_of(UP))
    assert symmetries(energy.U) == []
