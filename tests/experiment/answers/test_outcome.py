"""The outcome of a run: where the body rests, and how far from where it should."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from support.leg import leg

import rbstab
from rbstab.config.load import run_id
from rbstab.experiment.answers.outcome import OutcomeKind, outcome_of, pushes_of
from rbstab.experiment.answers.rest_modes import rest_modes
from rbstab.experiment.run_to_file import run_to_file
from rbstab.experiment.summary import NO_REST_STATE
from rbstab.mechanics.attitude import tilt

CASES = Path(__file__).parents[2] / "data/cases"

LOAD = 3.5 * 9.81 * 0.186
"""m g l of the leg, N m: it stands on springs that are stiffer."""

LEANING = brentq(lambda angle: 5.0 * angle - LOAD * math.sin(angle), 0.1, 3.0)
"""rad: where springs of 5 N m/rad hold the leg."""

LEANS = f"desired.orientation=[0, {LEANING}, 0]"


def config(name, *changes):
    """Return a case with some values changed."""
    return rbstab.load_config(CASES / f"{name}.yaml", changes)


@pytest.fixture(scope="module")
def fallen():
    """Return the run of the leg that falls over."""
    return rbstab.simulate(config("leg_falls"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "kind", "away"),
    [
        ((), "rests_elsewhere", LEANING),
        ((LEANS,), "returns", 0.0),
        (("desired.orientation={deg: [0, 60, 0]}",), "returns", LEANING - math.radians(60)),
        (
            ("desired={orientation: {deg: [0, 60, 0]}, within: {deg: 5}}",),
            "rests_elsewhere",
            LEANING - math.radians(60),
        ),
        (("desired.within=1.25",), "returns", LEANING),
    ],
)
def test_a_body_rests_where_it_is_wanted_or_elsewhere(fallen, changes, kind, away):
    outcome = outcome_of(fallen, config("leg_falls", *changes))
    assert outcome.kind == kind
    assert outcome.orientation == pytest.approx((0, LEANING, 0), abs=1e-6)
    assert outcome.tilt == pytest.approx(away, abs=1e-6)
    assert outcome.sureness == "seen"
    assert 0 < outcome.time < 5


@pytest.mark.parametrize(
    ("name", "changes", "kind"),
    [
        ("leg_stands", ("integration.duration=0.1",), "moving"),
        ("leg_stands", ("integration.duration=0.1", "integration.step_limit=3"), "failed"),
        ("leg_falls", ("initial.angular_velocity=[0, 30, 0]",), "left_range"),
        ("spin", (), "moving"),
    ],
)
def test_a_motion_that_does_not_come_to_rest(name, changes, kind):
    result = rbstab.simulate(config(name, *changes))
    outcome = outcome_of(result)
    assert outcome.kind == kind
    assert outcome.time == result["time"][-1]
    assert outcome.orientation == tuple(result["orientation"][-1])
    assert outcome.sentence.startswith(f"{outcome.kind.words} at t = ")


@pytest.mark.heavy
def test_the_outcome_of_a_leg_is_proved():
    falls = config("leg_falls")
    proof = rbstab.prove(falls)
    result = rbstab.simulate(falls, proof=proof, enclose=rbstab.Enclose.BRIEFLY)
    assert outcome_of(result, falls, proof).sentence == (
        "rests elsewhere: at (0°, 67.7°, 0°), 67.7° from the desired attitude: proved"
    )
    assert not pushes_of(falls, proof)
    stands = config("leg_stands")
    proof = rbstab.prove(stands)
    outcome = outcome_of(rbstab.simulate(stands, proof=proof), stands, proof)
    assert outcome.sentence == "returns: at (0°, 0°, 0°), 0° from the desired attitude: proved"
    assert "5.95 J" in (pushes := pushes_of(stands, proof))
    # About y, at the knee.
    fastest = math.sqrt(2 * 5.95 / (0.059 + 3.5 * 0.186**2))
    assert float(pushes.split("or ")[1].split()[0]) == pytest.approx(fastest, abs=0.01)


PUSHED = {
    "free": ("any axis through the centre of gravity", [0, 0, 0]),
    "visco-elastic": ("any axis through the contact point", [0, 0, -0.25]),
    "permanent": ("any axis", [0, 0, -0.25]),
}


@pytest.mark.parametrize("variant", PUSHED)
def test_pushes_say_through_which_point_their_axis_goes(variant, rng):
    """Of the fastest spins about it one has the energy that is printed; about others more."""
    words, point = PUSHED[variant]
    inertia = [0.02, 0.035, 0.025]
    controller = {"variant": variant, "K_r": [2.0] * 3, "L_r": [0.1] * 3}
    controller |= {"K_t": [10.0] * 3, "L_t": [1.0] * 3}
    if variant == "visco-elastic":
        controller |= {"K_c": [100.0] * 3, "L_c": [5.0] * 3}
    data = {
        "body": {"mass": 2.0, "inertia": inertia, "contact_point": [0, 0, -0.25]},
        "controller": controller,
        "initial": {"orientation": [0.1, 0, 0]},
        "integration": {"duration": 8.0},
    }
    loaded = rbstab.load_config(data)
    pushes = pushes_of(loaded, rbstab.prove(loaded))
    match = re.fullmatch(
        r"pushes below (\S+) J \(or (\S+) rad/s about (.+)\), from rest .*", pushes
    )
    assert match is not None
    assert match[3] == words
    axes = rng.normal(size=(2000, 3))
    spins = float(match[2]) * axes / np.linalg.norm(axes, axis=1)[:, None]
    speeds = np.cross(spins, -np.array(point))
    energies = 0.5 * (spins**2 @ inertia + 2.0 * (speeds**2).sum(axis=1))
    assert 0.99 * float(match[1]) < energies.max() <= float(match[1]) * 1.001


@pytest.mark.slow
def test_what_is_wanted_is_no_part_of_a_run(tmp_path):
    """The stored run is used again, and says what is wanted now."""
    plain, leaning = config("leg_falls"), config("leg_falls", LEANS)
    assert run_id(plain) == run_id(leaning)
    file = tmp_path / "leg.h5"
    assert run_to_file(plain, file).computed
    again = run_to_file(leaning, file)
    assert not again.computed
    stored = rbstab.open_result(file)
    assert rbstab.load_config(plain).desired is None
    assert "desired" in stored.config
    assert stored.outcome == outcome_of(stored, leaning)
    assert (stored.outcome.kind, rbstab.simulate(plain).outcome.kind) == (
        "returns",
        "rests_elsewhere",
    )
    assert (stored["orientation"] == again.result["orientation"]).all()


def test_the_tilt_is_the_angle_of_the_rotation_between_two_attitudes(
    rng,
):
    Theta, desired = rng.uniform(-3, 3, (50, 3)), rng.uniform(-3, 3, 3)
    a, b = (Rotation.from_euler("XYZ", angles) for angles in (Theta, desired))
    assert tilt(Theta, desired) == pytest.approx((b.inv() * a).magnitude(), abs=1e-7)
    # A half turn about y has two descriptions.
    half = np.array([[math.pi, 0.0, math.pi]])
    assert tilt(half, np.zeros(3)) == pytest.approx([math.pi])


@pytest.mark.slow
@pytest.mark.parametrize(("stiffness", "kind"), [(10, "returns"), (5, "at_unstable_rest")])
def test_a_body_at_rest_where_it_would_fall_is_said_to_be_unstable(stiffness, kind):
    given = leg(stiffness, initial={"position": [0, 0, -3.5 * 9.81 / (4e4 + 1e-6)]})
    outcome = outcome_of(rbstab.simulate(rbstab.load_config(given, ["integration.duration=0.1"])))
    assert (outcome.kind, outcome.is_good) == (kind, kind == "returns")


HELD = {"variant": "permanent", "K_r": [10, 10, 5], "L_r": [0.8, 0.8, 0.3]}


def pushed(quantity, signal, amplitude, **more):
    """Return a held leg of 10 N m/rad under an input, at rest at first."""
    load = {"kind": "input", "quantity": quantity, "amplitude": amplitude, "signal": signal, **more}
    given = leg(controller=HELD, initial={}, elements={"push": load})
    return rbstab.load_config(given, ["integration.duration=8"])


def test_a_constant_force_is_a_load_under_which_rest_is_proved():
    """K θ = m g l sin θ + F h cos θ, with the force F at the height h above the joint."""
    given = pushed("force", {"kind": "constant"}, 5.0, point=[0, 0, 0.1], direction=[1, 0, 0])
    proof = rbstab.prove(given)
    leans = brentq(lambda a: 10.0 * a - LOAD * math.sin(a) - 5.0 * 0.286 * math.cos(a), 0.0, 1.5)
    (state,) = proof.states
    assert state.orientation == pytest.approx((0.0, leans, 0.0), abs=1e-9)
    assert proof.globally_stable
    run = rbstab.simulate(given, proof=proof)
    outcome = outcome_of(run, given, proof)
    assert (outcome.kind, outcome.sureness) == ("rests_elsewhere", "proved")
    assert outcome.tilt == pytest.approx(leans, abs=1e-9)
    assert "supplied_energy" not in run


@pytest.mark.parametrize(
    ("signal", "kind", "why"),
    [
        ({"kind": "constant"}, "rests_elsewhere", "under its inputs"),
        ({"kind": "sine", "frequency": 1.0}, "moving", ""),
    ],
)
def test_a_body_that_stands_under_a_load_is_not_moving(signal, kind, why):
    """A couple M about y: K θ = m g l sin θ + M."""
    outcome = outcome_of(rbstab.simulate(pushed("couple", signal, 1.2, direction=[0, 1, 0])))
    assert (outcome.kind, outcome.why) == (kind, why)
    if why:
        leans = brentq(lambda angle: 10.0 * angle - LOAD * math.sin(angle) - 1.2, 0.0, 1.0)
        assert outcome.tilt == pytest.approx(leans, abs=1e-6)


def test_a_result_shows_its_outcome_first(fallen):
    away = f"{math.degrees(LEANING):.1f}°"
    assert f"outcome rests elsewhere, {away} away: seen, status completed" in repr(fallen)


@pytest.mark.parametrize(("stiffness", "growing"), [(10, 0), (5, 2)])
def test_modes_of_an_unstable_rest_state_grow(stiffness, growing):
    """An upright leg falls over about both axes if K_r < m g l = 6.386 N m/rad."""
    given = leg(stiffness, initial={"position": [0, 0, -3.5 * 9.81 / (4e4 + 1e-6)]})
    upright = rbstab.load_config(given, ["integration.duration=0.1"])
    modes = rest_modes(rbstab.simulate(upright), upright)
    assert modes is not None
    assert modes.growing == growing
    assert ("2 modes grow: this rest state is unstable" in str(modes)) == (growing == 2)


def modes_of(**controller):
    """Return what is said of the modes of a body of 12 kg that is tied at (0, 0, -0.25)."""
    config = rbstab.load_config(
        {
            "body": {"mass": 12, "inertia": [0.29, 0.34, 0.13], "contact_point": [0, 0, -0.25]},
            "controller": controller,
            "integration": {"duration": 0.1},
        }
    )
    modes = rest_modes(rbstab.simulate(config), config)
    return "" if modes is None else str(modes)


def test_modes_without_damping_are_said_not_to_decay():
    """Free, with a spring on the angles: sqrt(60/0.34), sqrt(60/0.29), sqrt(30/0.13), 3 drifts."""
    modes = modes_of(variant="free", K_r=[60, 60, 30])
    assert modes.startswith("natural frequencies 13.28, 14.38, 15.19 rad/s; 6 real eigenvalues (no")
    assert "no mode decays" in modes
    held = modes_of(variant="permanent", K_r=[60, 60, 30])
    assert "no mode decays" in held
    assert "τ" not in held


def test_turns_without_a_spring_have_no_frequency():
    """A tie leaves the turns about C free: they neither oscillate nor decay."""
    tie = {"K_c": [400] * 3, "L_c": [8] * 3}
    modes = modes_of(variant="visco-elastic", **tie)
    # Along z: sqrt(400/12). Across: 400 (1/12 + 0.25²/J), for J = 0.34 and 0.29.
    assert modes.startswith("natural frequencies 5.774, 10.34, 10.93 rad/s; 6 real eigenvalues (no")
    assert "6 modes do not decay; of the others, the slowest mode decays with τ = 3 s" in modes
    with_springs = modes_of(variant="visco-elastic", K_r=[60, 60, 30], **tie)
    assert "1 mode does not decay" in with_springs


def tie(point, anchor, stiffness=80, damping=4):
    gains = {"K_c": [stiffness] * 3, "L_c": [damping] * 3}
    return {"kind": "visco-elastic", "point": point, "anchor": anchor, **gains}


@pytest.fixture(scope="module")
def pitched():
    """Return a config, and its run: ties hold the body where θ2 = 90°, and Θ is singular."""
    ties = {
        "a": tie([0.3, 0, 0], [0, 0, -0.3]),
        "b": tie([0, 0.3, 0], [0, 0.3, 0]),
        "c": tie([0, 0, 0], [0, 0, 0]),
    }
    given = leg(gravity=[0, 0, 0], elements=ties)
    del given["controller"]
    changes = ["initial.angular_velocity=[0.1, 0.4, 0.1]", "integration.duration=40"]
    loaded = rbstab.load_config(given, changes)
    assert loaded.integration.coordinates == "quaternion"
    return loaded, rbstab.simulate(loaded)


def test_a_body_comes_to_rest_at_the_pole_of_its_angles(pitched):
    loaded, result = pitched
    outcome = outcome_of(result, loaded)
    assert outcome.kind is OutcomeKind.RESTS_ELSEWHERE
    assert outcome.time < 40
    assert outcome.tilt == pytest.approx(math.pi / 2, abs=1e-9)
    assert outcome.orientation is not None
    turned = Rotation.from_euler("XYZ", outcome.orientation).as_matrix()
    assert turned == pytest.approx(Rotation.from_euler("y", math.pi / 2).as_matrix(), abs=1e-6)
    assert max(map(abs, outcome.orientation)) <= math.pi
    # Frequencies of small motions, from the masses and stiffnesses of translation and rotation.
    turn = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    K, M = np.zeros((6, 6)), np.zeros((6, 6))
    for element in loaded.elements.values():
        arm = turn @ element.point
        to_point = np.hstack([np.eye(3), np.cross(np.eye(3), arm).T])
        K += 80 * to_point.T @ to_point
    M[:3, :3] = loaded.body.mass * np.eye(3)
    M[3:, 3:] = turn @ np.diag(loaded.body.inertia) @ turn.T
    squares = eigh(K, M, eigvals_only=True)
    modes = rest_modes(result, loaded)
    assert modes is not None
    # Damping is proportional to stiffness, so |λ| = ω. The fastest mode is overdamped.
    assert modes.frequencies == pytest.approx(np.sqrt(squares)[:5], rel=1e-6)
    assert modes.others == 2


@pytest.mark.parametrize(("speed", "kind"), [(0.0, "rests_elsewhere"), (1.0, "moving")])
def test_a_body_stands_still_also_where_no_rest_state_was_found(pitched, speed, kind):
    loaded, result = pitched
    energy = result["energy"].copy()
    energy[-1] += speed
    attributes = result.attributes | {"lyapunov_zero": NO_REST_STATE}
    arrays = {"settling_time": np.array(np.nan), "energy": energy}
    changed = {name: result.variables[name]._replace(data=data) for name, data in arrays.items()}
    unknown = replace(result, variables=result.variables | changed, attributes=attributes)
    assert outcome_of(unknown, loaded).kind == kind


@pytest.mark.parametrize("pitch", [90, 89.9999])
def test_modes_do_not_depend_on_the_attitude_at_which_a_body_rests(pitch):
    """Near θ2 = ±90° rates of Θ are singular. The same body is turned by turning its anchors."""
    points = ([0, 0, 0.25], [0.2, 0, 0], [0, 0.2, 0])
    spectra = []
    for angle in (0, pitch):
        turn = Rotation.from_euler("y", angle, degrees=True).as_matrix()
        ties = {f"t{k}": tie(p, (turn @ p).tolist(), 1000, 50) for k, p in enumerate(points)}
        given = leg(gravity=[0, 0, 0], elements=ties)
        del given["controller"]
        start = f"initial.orientation={{deg: [0, {min(angle, 80)}, 0]}}"
        loaded = rbstab.load_config(given, [start, "integration.duration=20"])
        modes = rest_modes(rbstab.simulate(loaded), loaded)
        assert modes is not None
        assert modes.growing == 0
        spectra.append([*modes.frequencies, modes.slowest])
    assert spectra[1] == pytest.approx(spectra[0], rel=1e-6)


@pytest.mark.parametrize("tilt_of_start", [[10, 0, 0], [0, 10, 0], [0, -10, 30]])
def test_v_counts_from_the_hanging_pose_whatever_way_a_pendulum_begins_to_fall(tilt_of_start):
    """A descent in energy passes θ2 = ±90°. The pendulum falls by m g l (1 + cos 10°)."""
    zero = [0, 0, 0]
    held = {"variant": "permanent", "K_t": zero, "L_t": zero, "K_r": zero, "L_r": [0.1] * 3}
    body = {"mass": 12, "inertia": [0.3, 0.3, 0.13], "contact_point": [0, 0, -0.25]}
    initial = {"orientation": {"deg": tilt_of_start}}
    given = leg(body=body, controller=held, initial=initial, integration={"duration": 0.3})
    v = rbstab.simulate(given)["lyapunov"]
    assert v[0] == pytest.approx(12 * 9.81 * 0.25 * (1 + math.cos(math.radians(10))), rel=1e-9)
