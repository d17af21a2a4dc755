"""Switches at the same instant, and surfaces touched but not crossed, are handled right."""

from dataclasses import replace

import numpy as np
import pytest
from support.problems import each_engine
from support.sliding import audit, ball_in_a_V, pushed_ball, solve_sliding

from rbstab.integrate.status import RunStatus

M, K = 2.0, 30.0
FREE = np.zeros((3, 3))


def limited_solve(engine, problem):
    """Solve with limits that a run reaches only if it gets stuck at a coincidence."""
    switching = replace(problem.switching, switch_limit=1000)
    limits = {"step_limit": 5000, "time_limit": 5.0}
    run = solve_sliding(engine, replace(problem, switching=switching, **limits))
    assert run.status is RunStatus.COMPLETED, run.detail
    return run


@each_engine
@pytest.mark.parametrize("sides", [(1, 1, 1), (1, -1, 1), (-1, -1, 1)])
def test_three_axes_cross_at_every_instant(engine, sides):
    """From x = ±0.3 at rest each axis falls, then makes flights of twice the time of the fall."""
    x, sides = 0.3, np.array(sides, dtype=float)
    times = np.linspace(0, 4.9, 8)
    run = limited_solve(
        engine, ball_in_a_V(M, K, np.zeros(3), np.zeros(3), x * sides, np.zeros(3), times)
    )
    fall = np.sqrt(2 * x * M / K)
    expected = np.arange(fall, 4.9, 2 * fall)
    assert len(expected) > 10
    for axis in range(3):
        switch_times = run.switches.switch_times[run.switches.switch_axes == axis]
        assert switch_times == pytest.approx(expected, abs=1e-10)
    assert run.states[:, 6:9] * sides == pytest.approx(
        np.repeat(run.states[:, 6:7] * sides[0], 3, axis=1), abs=1e-10
    )
    assert audit(run) < 1e-10


@each_engine
def test_a_parabola_that_touches_the_position(engine):
    """One axis touches x = 0 up to round-off, one misses it, and one dips below by 1e-8.

    Above ẍ = 2, below ẍ = 32. Round-off decides whether the first axis switches, but not its path.
    """
    load, depth = np.full(3, 34.0), 1e-8
    X, V = np.array([1.0, 1.0 + depth, 1.0 - depth]), np.full(3, -2.0)
    times = np.linspace(0, 2, 9)
    run = limited_solve(engine, pushed_ball(M, np.full(3, K), load, FREE, X, V, times))
    speed = np.sqrt(4 * depth)
    shorter = 2 * speed / 2 - 2 * speed / 32
    later = times > 1
    expected = X + np.outer(times, V) + (times**2)[:, None]
    # After its dip the third axis moves as it would without one, only earlier.
    sooner = times[later] + shorter
    expected[later, 2] = X[2] + V[2] * sooner + sooner**2
    for axis, within in ((0, 1e-7), (1, 1e-12), (2, 1e-10)):
        # At t = 1 itself the third axis is inside its dip.
        rows = times != 1
        assert run.states[rows, 6 + axis] == pytest.approx(expected[rows, axis], abs=within)
    assert (run.switches.modes[-1] == 1).all()
    assert run.switches.counts[-1, 0] % 2 == 0
    assert run.switches.counts[-1, 1:].tolist() == [0, 2]
    switch_times = run.switches.switch_times[run.switches.switch_axes == 2]
    first = 1 - speed / 2
    assert switch_times == pytest.approx([first, first + 2 * speed / 32], abs=1e-10)
