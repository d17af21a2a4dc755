"""`coordinates: quaternion`: motions past θ2 = ±90°, and the same motions as in Euler angles."""

import copy
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.problems import ENGINES

from rbstab.analysis.run_extremes import (
    PARTS_IN_QUATERNIONS,
    THETA_ROWS,
    VALUE,
    divided,
    leave_open,
)
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.integrate import step_ends
from rbstab.integrate.engines import engine
from rbstab.integrate.in_quaternions import NEVER, in_quaternions
from rbstab.mechanics.attitude import rotation, rotations
from rbstab.systems.coordinates import CentreCoordinates, QuaternionCoordinates
from rbstab.systems.schedule import NO_LEGS

BODY = {"mass": 2.0, "inertia": [0.2, 0.2, 0.5], "contact_point": [0, 0, -0.4]}
FREE: dict[str, Any] = {
    "schema_version": 2,
    "body": BODY,
    "initial": {"velocity": [0.3, 0, 0.1]},
    "integration": {"duration": 5.0, "samples": 101},
}
TIED: dict[str, Any] = {
    "schema_version": 2,
    "body": BODY | {"inertia": [0.1, 0.2, 0.25]},
    "gravity": [0, 0, -9.81],
    "elements": {
        "rope": {
            "kind": "embedded",
            "point": [0, 0.1, -0.4],
            "anchor": [0, 0, 0],
            "K_c": [90, 100, 120],
            "L_c": [3, 3, 3],
            "K_d": [200, 200, 200],
            "L_d": [9, 9, 9],
        },
        "upright": {"kind": "attitude", "K": [1, 2, 3], "L": [0.05, 0.05, 0.05]},
        "gust": {
            "kind": "input",
            "quantity": "couple",
            "direction": [0, 0, 1],
            "amplitude": 0.5,
            "signal": {"kind": "pulse", "start": 1.0, "duration": 0.7},
        },
    },
    "initial": {"orientation": [0.3, 0.2, -0.1], "angular_velocity": [4, -3, 12]},
    "integration": {"duration": 3.0, "samples": 61},
}
HELD: dict[str, Any] = {
    "schema_version": 2,
    "body": BODY,
    "gravity": [0, 0, -9.81],
    "controller": {"variant": "permanent", "L_r": [0.02] * 3, "K_t": [9] * 3, "L_t": [1] * 3},
    "initial": {"orientation": [0.2, 0.3, 0.1], "angular_velocity": [1, 2, 25]},
    "integration": {"duration": 2.0, "samples": 41},
}
SLIDING: dict[str, Any] = {
    **copy.deepcopy(TIED),
    "elements": {
        "grip": {
            "kind": "sliding",
            "point": [0.2, 0, 0.1],
            "anchor": [0.2, 0, 0.1],
            "K_s": [60, 60, 60],
            "surface": {"slope": 8},
        },
        "cord": {
            "kind": "ligament",
            "point": [0, 0, 0.3],
            "anchor": [0, 0.2, 0.6],
            "stiffness": 300,
            "damping": 3,
            "slack_length": 0.35,
            "toe_strain": 0.1,
        },
        "upright": TIED["elements"]["upright"],
    },
    "initial": {"orientation": [0.3, 0.2, -0.1], "angular_velocity": [2, -1, 3]},
    "integration": {"duration": 1.0, "samples": 41},
}


def problem(config, coordinates=None, **changes):
    """Return the problem of a config with changed sections."""
    data = copy.deepcopy(config)
    for name, section in changes.items():
        data[name] = data.get(name, {}) | section
    data["integration"]["coordinates"] = coordinates or "quaternion"
    return problem_of(load_config(data))


def solved(name, given):
    trajectory = engine(name)(given)
    assert trajectory.status == "completed"
    return trajectory


@pytest.mark.parametrize("name", ENGINES)
def test_a_symmetric_top_passes_the_pole(name):
    # L is along y, and the axis of the body turns about it: θ2 passes ±90° again and again.
    Theta, Omega = np.array([0.4, 0.2, 0.1]), np.array([1.0, 7.0, 0.5])
    given = problem(
        FREE, initial={"orientation": Theta.tolist(), "angular_velocity": Omega.tolist()}
    )
    trajectory = solved(name, given)
    J1, J3 = 0.2, 0.5
    momentum = rotation(Theta) @ (np.array([J1, J1, J3]) * Omega)
    fine = np.linspace(0.0, 5.0, 20_001)
    # ω = L/J1 + (1 - J3/J1) Ω3 e3, and so the body turns about L and about its own axis.
    about_axis = Rotation.from_rotvec(np.outer((1 - J3 / J1) * Omega[2] * fine, [0, 0, 1.0]))
    about_L = Rotation.from_rotvec(np.outer(fine, momentum / J1))
    exact = about_L * Rotation.from_matrix(rotation(Theta)) * about_axis
    expected = np.unwrap(exact.as_euler("XYZ"), axis=0)[::200]
    A = exact.as_matrix()[::200]
    assert np.abs(expected[:, 1]).max() > 1.3
    assert rotations(trajectory.states[:, :3]) == pytest.approx(A, abs=1e-9)
    sharp = 1e-9 / np.cos(expected[:, 1:2]).min()
    assert trajectory.states[:, :3] == pytest.approx(expected, abs=sharp)
    assert np.ptp(trajectory.states[:, 2]) > 8 * math.pi
    position = np.outer(trajectory.times, [0.3, 0, 0.1])
    assert trajectory.states[:, 6:9] == pytest.approx(position, abs=1e-12)


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("samples", [6, 61])
@pytest.mark.parametrize("config", [TIED, HELD], ids=["tied", "held"])
def test_the_motion_is_that_in_angles(name, samples, config):
    angles = "reduced" if config is HELD else "Z"
    given = problem(config, integration={"samples": samples})
    trajectory = solved(name, given)
    expected = solved(name, problem(config, angles, integration={"samples": samples}))
    assert (trajectory.states[0] == given.start).all()
    assert np.ptp(expected.states[:, 2]) > 2 * math.pi
    assert trajectory.states == pytest.approx(expected.states, abs=1e-9)
    assert trajectory.lyapunov_change == pytest.approx(expected.lyapunov_change, abs=1e-9)
    assert trajectory.breakpoints.tolist() == expected.breakpoints.tolist()


@pytest.mark.parametrize("name", ENGINES)
def test_turns_between_few_samples_are_counted_where_no_ends_of_steps_are_kept(name, monkeypatch):
    given = problem(TIED, integration={"samples": 6})
    expected = solved(name, given)
    monkeypatch.setattr(step_ends, "MOST", 10)
    trajectory = solved(name, given)
    assert not trajectory.ends.complete
    assert expected.ends.complete
    assert trajectory.states == pytest.approx(expected.states, abs=1e-12)


@pytest.mark.parametrize("name", ENGINES)
def test_elements_that_switch_do_so_at_the_same_times(name):
    trajectory, expected = solved(name, problem(SLIDING)), solved(name, problem(SLIDING, "Z"))
    assert trajectory.states == pytest.approx(expected.states, abs=1e-9)
    modes = [
        [system.elements[1].mode.tolist() for system in run.systems]
        for run in (trajectory, expected)
    ]
    assert modes[0] == modes[1]
    assert {system.coordinates.name for system in trajectory.systems} == {"Z"}
    assert len(set(trajectory.systems)) <= len(set(expected.systems)) + 2


@pytest.mark.parametrize("name", ENGINES)
def test_the_length_of_q_changes_no_motion(name):
    given = problem(TIED, elements={"gust": TIED["elements"]["upright"]})
    system, q = in_quaternions(given.system)
    runs = []
    for length in (1.0, 1.7):
        start = q.from_angles(given.start)
        start[[0, 1, 2, q.angles.size]] *= length
        inner = replace(
            given, system=system, start=start, range_bound=NEVER, quaternion=False, schedule=NO_LEGS
        )
        trajectory = solved(name, inner)
        norms = np.linalg.norm(trajectory.states[:, [0, 1, 2, q.angles.size]], axis=1)
        assert norms == pytest.approx(length, abs=1e-9)
        alone = np.zeros(len(trajectory.times), dtype=int)
        Theta, _ = q.angles_along(
            trajectory.states.T, trajectory.times, given.start[:3, np.newaxis], alone
        )
        runs.append(q.to_angles(trajectory.states.T, Theta))
    assert runs[1] == pytest.approx(runs[0], abs=1e-9)


def test_only_a_step_near_the_pole_is_divided_into_many_parts():
    system, q = in_quaternions(problem(TIED).system)
    start = np.zeros(system.audited_size)
    start[: system.size] = q.from_angles(problem(TIED).start)
    table = np.zeros((2, 2, VALUE + 1))
    counts = []
    for rate in (0.0, np.inf):
        table[0, 1, THETA_ROWS] = rate
        steps = divided(system, (0.0, 1e-3), start, 0.0, table)
        assert steps is not None
        counts.append(len(steps.begin))
    assert counts[0] < 10
    assert counts[1] >= PARTS_IN_QUATERNIONS


def test_a_step_whose_angles_go_beyond_its_ends_near_the_pole_is_left_open():
    rng, turn, q = np.random.default_rng(4), 0.7, QuaternionCoordinates(CentreCoordinates())
    times, opened = np.linspace(0, 1, 401), 0
    for _ in range(200):
        axis = Rotation.random(random_state=rng.integers(2**31)).as_matrix()[0]
        pitch = math.pi / 2 - rng.uniform(-2 * turn, 2 * turn)
        begin = Rotation.from_euler("XYZ", [rng.uniform(-3, 3), pitch, rng.uniform(-3, 3)])
        path = Rotation.from_rotvec(np.outer(turn * times, axis)) * begin
        angles = np.unwrap(path.as_euler("XYZ"), axis=0).T
        upright = np.cos(angles[1])
        if upright.min() < 0.01:
            continue
        ends = path[[0, -1]].as_quat(scalar_first=True)
        ends[1] *= np.sign(ends[0] @ ends[1])
        y = np.zeros((q.size, 2))
        y[:3], y[3:6], y[-1] = ends[:, 1:].T, turn * begin.inv().apply(axis)[:, None], ends[:, 0]
        turned = q.watched(y)
        turned[0, ::2] = angles[::2][:, [0, -1]]
        table = np.zeros((2, 2, VALUE + 1, 1))
        table[:, :, THETA_ROWS, 0] = np.moveaxis(turned, -1, 0)
        leave_open(table, q, y, np.array([1]), np.ones(1), np.zeros(1, dtype=int))
        is_open = np.asarray(np.isinf(table[:, 1, THETA_ROWS, 0]).all(axis=0))
        assert not is_open[1]
        if upright[[0, -1]].min() > turn:
            assert not is_open.any()
            continue
        sizes = np.abs(angles)
        beyond = sizes.max(axis=1) - sizes[:, [0, -1]].max(axis=1) > 0.02
        assert is_open[::2][beyond[::2]].all()
        opened += beyond[::2].sum()
    assert opened > 10
