"""Entries of A as forms of quaternions, and energies in the four charts."""

import numpy as np
import pytest
from support.rotations import attitude, config_of, held, tie, traced, zero_of_chart

from rbstab.analysis.configuration import configurations
from rbstab.mechanics.attitude import quaternions, rotation
from rbstab.mechanics.quaternion import sharp_angles
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.enclosures.taylor import value_at
from rbstab.proof.rotations.forms import in_chart
from rbstab.proof.rotations.lists import configuration_at
from rbstab.proof.rotations.states import RestRotation

TIED = config_of(
    {
        "a": tie([0.1, 0.2, 0], [0.2, 0.1, 0.3], K=[100, 300, 200]),
        "b": {"kind": "embedded", "point": [0, -0.2, 0.1], "anchor": [0, 0, 0], "K_c": [80, 90, 70]}
        | {"L_c": [1, 1, 1], "K_d": [60, 50, 40], "L_d": [5, 5, 5]},
        "up": attitude([3, 4, 5]),
    },
    gravity=[0, 0, -9.81],
)
SPRUNG = held(
    {
        "s": {"kind": "spring", "point": [0.1, 0, 0.2], "anchor": [0.6, 0.1, 0.4]}
        | {"stiffness": 60, "rest_length": 0.4},
        "l": {"kind": "ligament", "point": [0, 0.1, 0.2], "anchor": [0, 0.5, 0.4]}
        | {"stiffness": 40, "slack_length": 0.3, "toe_strain": 0.05},
    },
    {"K_t": [60, 25, 50]},
)


@pytest.mark.parametrize("config", [TIED, SPRUNG], ids=["tied", "sprung"])
def test_the_energy_in_each_chart_is_that_of_the_program_at_its_angles(config):
    system, energy, _ = traced(config)
    at = configurations(system)
    rng = np.random.default_rng(3)
    for _ in range(3):
        Theta = rng.uniform([-3, -1.5, -3], [3, 1.5, 3])
        q = quaternions(rotation(Theta)[None])[0]
        state = RestRotation(q, 0.0, 0, 0.0, 0.0)
        rest = configuration_at(energy, state)
        expected = at.energy(np.array([*Theta, *(rest[k] for k in range(3, at.size))]))
        for k in range(4):
            x = np.delete(q / q[k], k)
            assert value_at(in_chart(energy.U, k), x) == pytest.approx(expected, rel=1e-9)


def test_where_ligaments_hold_it_the_position_is_the_lowest_at_each_rotation():
    line = {"kind": "ligament", "point": [0.1, 0, 0.2], "anchor": [0.4, 0.1, 0.9], "stiffness": 80}
    line |= {"slack_length": 0.3, "toe_strain": 0.05}
    tied = config_of({"tie": tie([0, 0, -0.1], K=[60, 50, 70]), "line": line})
    system, energy, _ = traced(tied)
    assert energy.free == (3, 4, 5)
    at = configurations(system)
    q = [1, 0.7, 0.1, -0.9]
    rest = configuration_at(energy, zero_of_chart(0, q[1:]))
    where = np.array([*sharp_angles(q[0], np.array(q[1:])), *(rest[k] for k in (3, 4, 5))])
    # The line is taut, so this is not where the tie alone would hold it.
    assert at.energies(where)[-1] > 1e-3
    assert np.abs(at.gradient(where)[3:]).max() < 1e-7
    V = BoundedEnergy(in_chart(energy.U, 0), free=energy.free)
    assert V.at(np.array([q[1:]]).T)[0][0] == pytest.approx(at.energy(where))
