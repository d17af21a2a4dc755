"""Samples are where they were requested, as exact as steps, and cost few extra steps."""

import numpy as np
import pytest
from support.problems import ENGINES, bare_system, problem, solve

from rbstab.integrate.engines import engine
from rbstab.mechanics.body import Body

ONE_STEP_METHODS = ("DOP853", "RK45", "Radau")

# A spinning body on soft springs: its steps are much longer than the sampling intervals below.
SYSTEM = bare_system(
    Body(2.0, np.diag([2.0, 1.5, 1.0]), np.array([0.15, 0.1, -0.42])),
    weight=(1.0, -2.0, -20.0),
    K_t=np.diag([30.0, 50.0, 40.0]),
    L_t=np.diag([1.0, 0.5, 2.0]),
    K_r=np.diag([5.0, 4.0, 6.0]),
    L_r=np.diag([0.5, 0.3, 0.2]),
)
START = np.concatenate([[0.1, -0.2, 0.3], [2.0, -1.0, 1.5], [0.2, 0.0, -0.1], [1.0, 0.5, -1.0]])
TIMES = np.linspace(0.0, 2.0, 401)


def followed(given, engine_name="scipy"):
    """Return the trajectory and the times of its steps."""
    steps: list[float] = []
    trajectory = engine(engine_name)(given, steps.append)
    assert trajectory.status == "completed"
    return trajectory, steps


def test_samples_are_as_exact_as_steps():
    trace = solve("scipy", problem(SYSTEM, START, TIMES))
    tight = solve("scipy", problem(SYSTEM, START, TIMES, rtol=2.5e-14, atol=2.5e-14))
    np.testing.assert_allclose(trace.states, tight.states, rtol=0, atol=1e-12)
    np.testing.assert_allclose(trace.lyapunov_change, tight.lyapunov_change, rtol=0, atol=1e-11)


def test_samples_between_lsodas_steps_are_as_exact_as_its_steps():
    tolerances = {"method": "LSODA", "rtol": 1e-10, "atol": 1e-10}
    trace, steps = followed(problem(SYSTEM, START, TIMES, **tolerances))
    tight = solve("scipy", problem(SYSTEM, START, TIMES, rtol=2.5e-14, atol=2.5e-14))
    assert len(steps) < len(TIMES)
    error = np.abs(trace.states - tight.states).max(axis=1)
    at_steps, _ = followed(problem(SYSTEM, START, [0.0, *steps], **tolerances))
    by_step = solve("scipy", problem(SYSTEM, START, [0.0, *steps], rtol=2.5e-14, atol=2.5e-14))
    assert error.max() < 2 * np.abs(at_steps.states - by_step.states).max()


@pytest.mark.parametrize("method", ["DOP853", "RK45", "LSODA", "Radau"])
def test_samples_add_at_most_one_step_each(method):
    # A step that a sample cuts short must not make the next steps short.
    tolerances = {"method": method, "rtol": 1e-8, "atol": 1e-8}
    alone = solve("scipy", problem(SYSTEM, START, [0.0, 2.0], **tolerances))
    # Pairs of samples: the second cuts the step after the first very short.
    pairs = np.linspace(0.0, 2.0, 7)[1:-1]
    times = np.sort(np.concatenate([[0.0, 2.0], pairs, pairs + 1e-9]))
    sampled = solve("scipy", problem(SYSTEM, START, times, **tolerances))
    assert sampled.steps <= alone.steps + len(times)


@pytest.mark.parametrize("engine_name", ENGINES)
def test_samples_may_start_anywhere_and_lie_anywhere(engine_name):
    times = np.array([0.0, 1e-6, 0.3, 0.30001, 1.7])
    plain = solve(engine_name, problem(SYSTEM, START, times))
    later = solve(engine_name, problem(SYSTEM, START, times + 100.0))
    np.testing.assert_array_equal(plain.times, times)
    np.testing.assert_array_equal(later.times, times + 100.0)
    # The equations do not depend on time; the samples do, with a round-off of 1e-14 of 100 s.
    np.testing.assert_allclose(later.states, plain.states, rtol=0, atol=1e-11)


@pytest.mark.parametrize("engine_name", ENGINES)
@pytest.mark.parametrize("method", ["DOP853", "LSODA"])
def test_progress_climbs_to_the_end(engine_name, method):
    given = problem(SYSTEM, START, np.linspace(0.0, 2.0, 5), method=method, rtol=1e-9, atol=1e-9)
    trajectory, steps = followed(given, engine_name)
    assert len(steps) == trajectory.steps
    assert (np.diff([0.0, *steps]) > 0).all()
    assert steps[-1] == 2.0
