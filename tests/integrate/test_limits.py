"""Limits on steps and wall time stop a run, and the stopped run keeps what it has computed."""

import numpy as np
import pytest
import scipy.integrate
from support.hang_guard import within
from support.problems import METHODS, bare_system, problem, solve
from support.systems import random_body

import rbstab

each_method = pytest.mark.parametrize(("engine_name", "method"), METHODS)

SYSTEM = bare_system(
    random_body(np.random.default_rng(3)),
    weight=(10.0, -20.0, -200.0),
    K_t=400.0 * np.eye(3),
    L_t=10.0 * np.eye(3),
    K_r=300.0 * np.eye(3),
    L_r=20.0 * np.eye(3),
)
START = np.concatenate([[0.1, -0.2, 0.3], [2.0, -1.0, 1.5], np.zeros(6)])
TIMES = np.linspace(0.0, 2.0, 41)


def run(engine_name, method="DOP853", times=TIMES, **changes):
    tolerances = {"rtol": 1e-8, "atol": 1e-8, "method": method}
    return solve(engine_name, problem(SYSTEM, START, times, **(tolerances | changes)))


def test_scipy_gets_each_tolerance(monkeypatch):
    tolerances, method = [], scipy.integrate.DOP853

    def seen(*arguments, **options):
        solver = method(*arguments, **options)
        tolerances.append((np.max(solver.rtol), np.max(solver.atol)))
        return solver

    monkeypatch.setattr(scipy.integrate, "DOP853", seen)
    run("scipy", times=TIMES[:3], rtol=1e-5, atol=1e-9)
    assert len(tolerances) > 0
    assert all((rtol == 1e-5) and (atol == 1e-9) for rtol, atol in tolerances)


@each_method
@pytest.mark.parametrize("limit", [1, 7])
def test_step_limit_stops_the_run(engine_name, method, limit):
    trajectory = run(engine_name, method, step_limit=limit)
    assert trajectory.status == "step limit"
    assert trajectory.steps == limit
    stop = trajectory.times[-1]
    assert 0 < stop < 2.0
    assert trajectory.detail == f"stopped after {limit} steps at t = {stop:.9g} s"


@each_method
def test_stopped_run_is_the_beginning_of_the_whole_run(engine_name, method):
    whole = run(engine_name, method)
    stopped = run(engine_name, method, step_limit=whole.steps // 2)
    kept = len(stopped.times) - 1
    assert kept >= 5
    np.testing.assert_array_equal(stopped.times[:kept], TIMES[:kept])
    for name in ("states", "lyapunov_change", "contact_work"):
        np.testing.assert_array_equal(
            getattr(stopped, name)[:kept], getattr(whole, name)[:kept], err_msg=name
        )
    # It has all samples up to the stop, and the stop itself.
    assert TIMES[kept - 1] < stopped.times[-1] <= TIMES[kept]


@each_method
def test_time_limit_stops_the_run(engine_name, method):
    # Undamped and a million seconds long: no method reaches the end.
    system = bare_system(SYSTEM.body, K_r=300.0 * np.eye(3))
    # Compile first: the time limit of the guard is for the run only.
    solve(engine_name, problem(system, np.zeros(12), [0.0, 1.0], method=method))
    limits = {"time_limit": 0.3, "step_limit": 10**9}
    given = problem(system, START, [0.0, 1e-3, 1e6], method=method, **limits)
    trajectory = within(1.3, solve, engine_name, given)
    assert trajectory.status == "time limit"
    assert trajectory.status.depends_on_machine
    stop = trajectory.times[-1]
    assert 0 < stop < 1e6
    assert trajectory.detail == f"stopped after 0.3 s of wall time at t = {stop:.9g} s"
    # The run keeps what it has computed.
    assert trajectory.times[1] == 1e-3 or stop <= 1e-3
    assert np.isfinite(trajectory.states).all()


def test_time_limit_reaches_into_a_step_that_never_ends():
    # No step ends in this time, so the clock must be checked when rates are evaluated.
    given = problem(SYSTEM, START, [0.0, 2.0], time_limit=1e-9)
    trajectory = within(1.0, solve, "scipy", given)
    assert trajectory.status == "time limit"
    assert trajectory.detail == "stopped after 1e-09 s of wall time at t = 0 s"
    np.testing.assert_array_equal(trajectory.states, [START])
    assert trajectory.steps == 0


def test_a_step_of_no_length_is_a_failure():
    """LSODA takes only steps of zero length if its absolute tolerance is almost zero."""
    config = {
        "body": {"mass": 41, "inertia": [10, 9, 2], "contact_point": [0.15, 0.1, -0.42]},
        "controller": {
            "variant": "free",
            "K_t": [4100, 4100, 3280],
            "L_t": [200, 200, 140],
            "K_r": [400, 400, 320],
            "L_r": [60, 60, 42],
        },
        "initial": {"angular_velocity": [1, 2, -1]},
        "integration": {"duration": 0.1, "method": "LSODA", "atol": 1e-300, "time_limit": 20},
    }
    result = rbstab.simulate(config)
    assert result.status == "solver failure"
    assert "a step of zero length" in str(result.attributes["status_detail"])
