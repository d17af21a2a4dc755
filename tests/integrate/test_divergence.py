"""Every motion that overflows or starts from NaN ends soon with a status, not an exception."""

import re

import numpy as np
import pytest
from support import missing_heyoka
from support.hang_guard import within
from support.problems import ENGINES, METHODS, bare_system, problem, solve

from rbstab.elements.gravity import Gravity
from rbstab.mechanics.body import Body
from rbstab.systems.coordinates import CentreCoordinates
from rbstab.systems.system import System

BODY = Body(41.0, np.diag([10.0, 8.0, 4.0]), np.array([0.15, 0.1, -0.42]))
each_engine = pytest.mark.parametrize("engine_name", ENGINES)
each_method = pytest.mark.parametrize(("engine_name", "method"), METHODS)

TIME_LIMIT = 2.0


@pytest.fixture(scope="module", autouse=True)
def _compiled_before():
    # With an empty cache heyoka compiles for seconds; the time limit of the guard is for runs only.
    if missing_heyoka.INSTALLED:
        still = np.zeros(12)
        solve("heyoka", problem(bare_system(BODY), still, [0.0, 0.1], rtol=1e-9))


def outcome(engine_name, method, system, start, times=(0.0, 1.0, 2.0), **limits):
    """Run at loose tolerances; fail if the run takes longer than its time limit + 1 s."""
    settings = {"rtol": 1e-9, "atol": 1e-9, "method": method, "time_limit": TIME_LIMIT}
    given = problem(system, start, times, **(settings | limits))
    trajectory = within(given.time_limit + 1.0, solve, engine_name, given)
    rows = len(trajectory.times)
    assert trajectory.states.shape == (rows, system.size)
    assert trajectory.lyapunov_change.shape == trajectory.contact_work.shape == (rows,)
    assert (np.diff(trajectory.times) > 0).all()
    return trajectory


@each_method
@pytest.mark.parametrize("component", [0, 1, 4, 7, 11])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_start_without_a_number_diverged(engine_name, method, component, value):
    start = np.zeros(12)
    start[component] = value
    trajectory = outcome(engine_name, method, bare_system(BODY), start)
    assert trajectory.status == "diverged"
    assert trajectory.detail.endswith(" at t = 0 s")
    np.testing.assert_array_equal(trajectory.times, [0.0])
    np.testing.assert_array_equal(trajectory.states, [start])
    assert trajectory.steps == 0


@pytest.mark.parametrize("method", ["DOP853", "Radau"])
def test_finite_rates_that_no_step_can_follow_are_a_solver_failure(method):
    # The rates are of the order of 1e302; divided by the tolerances they overflow.
    start = np.concatenate([np.zeros(3), [1e150, 2e150, -1e150], np.zeros(6)])
    trajectory = outcome("scipy", method, bare_system(BODY, L_r=60.0 * np.eye(3)), start)
    assert trajectory.status == "solver failure"
    assert trajectory.detail.startswith(f"{method}: ")
    assert trajectory.detail.endswith(" at t = 0 s")


# X grows as exp(√(1e10/41) t), and overflows within 0.05 s.
AWAY = np.concatenate([np.zeros(6), [1.0, -0.5, 0.2], np.zeros(3)])


@each_engine
def test_motion_that_grows_out_of_the_numbers_diverged(engine_name):
    times = np.linspace(0.0, 2.0, 2001)
    system = bare_system(BODY, K_t=-1e10 * np.eye(3))
    # It takes a thousand steps.
    trajectory = outcome(engine_name, "DOP853", system, AWAY, times, time_limit=20.0)
    assert trajectory.status == "diverged"
    assert 0.005 < trajectory.times[-1] < 0.05
    stop = re.escape(f"{trajectory.times[-1]:.9g}")
    assert re.fullmatch(
        rf"the (state|rates) stopped being finite at t = {stop} s", trajectory.detail
    )
    # The stored samples are finite, and right: X(t) = X(0) cosh(√(k/m) t).
    assert np.isfinite(trajectory.states).all()
    assert np.isfinite(trajectory.lyapunov_change).all()
    assert np.isfinite(trajectory.contact_work).all()
    rows = slice(0, 5)
    growth = np.cosh(np.sqrt(1e10 / 41.0) * trajectory.times[rows])
    expected = np.outer(growth, AWAY[6:9])
    np.testing.assert_allclose(trajectory.states[rows, 6:9], expected, rtol=1e-5)


def with_gravity(weight):
    return System(BODY, (weight,), CentreCoordinates(), np.zeros(3))


class Vanishing(Gravity):
    """A weight that becomes NaN when the body has fallen by 1 m: √(1 + x3)."""

    def wrench(self, motion, states):
        whole = super().wrench(motion, states)
        return whole._replace(force=whole.force * np.sqrt(1.0 + motion.X[2]))


@pytest.mark.parametrize("method", ["DOP853", "RK45", "LSODA"])
def test_rates_that_stop_being_numbers_midway_diverged(method):
    system = with_gravity(Vanishing(np.array([0.0, 0.0, -410.0])))
    trajectory = outcome("scipy", method, system, np.zeros(12), np.linspace(0.0, 2.0, 201))
    assert trajectory.status == "diverged"
    assert -1.0 <= trajectory.states[-1, 8] < -0.99
    assert np.isfinite(trajectory.states).all()
