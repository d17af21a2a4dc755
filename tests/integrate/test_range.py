"""A run stops at the end of the range of eq. 5, where cos θ2 falls to its bound."""

import numpy as np
import pytest
from scipy.optimize import brentq
from support.problems import ENGINES, METHODS, bare_system, held_start, problem, solve

from rbstab.integrate.engines import engine
from rbstab.mechanics.body import Body
from rbstab.systems.coordinates import ReducedCoordinates

# LSODA and Radau have tolerances that they reach in a reasonable number of steps.
TOLERANCE = {"DOP853": 1e-12, "": 1e-12, "RK45": 1e-10, "LSODA": 1e-11, "Radau": 1e-9}
TIME_ERROR = {"DOP853": 1e-10, "": 1e-10, "RK45": 1e-9, "LSODA": 1e-9, "Radau": 1e-8}

each_method = pytest.mark.parametrize(("engine_name", "method"), METHODS)

# A turn about axis 2 alone is a damped oscillator: J2 θ̈ + L θ̇ + K θ = 0.
INERTIA, STIFFNESS, DAMPING = 8.0, 400.0, 60.0


def turning_system(stiffness=STIFFNESS, damping=DAMPING):
    return bare_system(
        Body(41.0, np.diag([10.0, INERTIA, 4.0]), np.array([0.15, 0.1, -0.42])),
        K_r=stiffness * np.eye(3),
        L_r=damping * np.eye(3),
    )


def turning_start(rate):
    return np.concatenate([np.zeros(3), [0.0, rate, 0.0], np.zeros(6)])


def theta2(rate, t):
    decay = DAMPING / (2 * INERTIA)
    pace = np.sqrt(STIFFNESS / INERTIA - decay**2)
    return rate / pace * np.exp(-decay * t) * np.sin(pace * t)


def turn(engine_name, method, rate, times, **changes):
    tolerances = {"rtol": TOLERANCE[method], "atol": TOLERANCE[method], "method": method}
    given = problem(turning_system(), turning_start(rate), times, **(tolerances | changes))
    return solve(engine_name, given)


@each_method
@pytest.mark.parametrize("bound", [1e-3, 0.4])
@pytest.mark.parametrize("rate", [32.0, -32.0])
def test_run_stops_where_the_bound_is_reached(engine_name, method, bound, rate):
    times = np.linspace(0.0, 2.0, 401)
    trajectory = turn(engine_name, method, rate, times, range_bound=bound)
    limit = np.arccos(bound)
    expected = brentq(lambda t: abs(theta2(rate, t)) - limit, 0.0, 0.15, xtol=1e-14)
    assert trajectory.status == "range left"
    stop = trajectory.times[-1]
    assert stop == pytest.approx(expected, rel=0, abs=TIME_ERROR[method])
    # The last row is the stop itself, up to the error of heyoka's polynomial of cos θ2.
    assert np.cos(trajectory.states[-1, 1]) == pytest.approx(bound, rel=0, abs=1e-11)
    assert np.sign(trajectory.states[-1, 1]) == np.sign(rate)
    assert trajectory.detail == f"cos θ2 fell to {bound:g} at t = {stop:.9g} s"
    # Nothing else moves, so the energy integral is the loss in the damper.
    work = 0.5 * INERTIA * (trajectory.states[-1, 4] ** 2 - rate**2) + 0.5 * STIFFNESS * limit**2
    assert trajectory.lyapunov_change[-1] == pytest.approx(work, rel=1e-6)


@pytest.mark.parametrize("engine_name", ENGINES)
def test_held_body_leaves_the_range_too(engine_name):
    # The same motion about a pin: the inertia about C replaces J2.
    body = Body(5.0, np.diag([1.0, 2.0, 1.5]), np.array([0.0, 0.0, 0.4]))
    system = bare_system(body, ReducedCoordinates())
    start = held_start(system, np.zeros(3), np.array([0.0, 3.0, 0.0]))
    trajectory = solve(engine_name, problem(system, start, [0.0, 2.0], range_bound=0.25))
    assert trajectory.status == "range left"
    # Without a couple it turns at constant speed.
    assert trajectory.times[-1] == pytest.approx(np.arccos(0.25) / 3.0, rel=0, abs=1e-11)


@pytest.mark.parametrize("engine_name", ENGINES)
@pytest.mark.parametrize("bound", [0.25, float(np.cos(1.3))], ids=["beyond", "on"])
def test_start_on_or_beyond_the_bound_is_the_stop(engine_name, bound):
    # It would turn back into the range, but a run must not start outside.
    start = turning_start(-1.0)
    start[1] = 1.3 if bound != 0.25 else 1.4
    given = problem(turning_system(), start, [3.0, 4.0], range_bound=bound)
    trajectory = solve(engine_name, given)
    assert trajectory.status == "range left"
    assert trajectory.detail == f"cos θ2 fell to {bound:g} at t = 3 s"
    np.testing.assert_array_equal(trajectory.times, [3.0])
    np.testing.assert_array_equal(trajectory.states, [start])
    assert trajectory.steps == 0


# Undamped, θ2 = 1.2 sin ωt. At these tolerances one step covers the whole peak. The body is beyond
# the bound for longer than a sixteenth of the step, the interval at which a step is checked.
@pytest.mark.parametrize(
    ("method", "rtol", "pace", "excess"),
    [
        ("DOP853", 1e-6, 2.0, 1e-3),
        ("RK45", 1e-3, 2.0, 1.5e-3),
        ("DOP853", 1e-6, 40.0, 1e-2),
    ],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_excursion_inside_one_long_step_is_noticed(method, rtol, pace, excess, side):
    system = turning_system(pace**2 * INERTIA, 0.0)
    tolerances = {"method": method, "rtol": rtol, "atol": rtol}
    start = turning_start(side * 1.2 * pace)
    end = 3.0 / pace
    wide = problem(system, start, [0.0, end], **tolerances)
    steps = [0.0]
    assert engine("scipy")(wide, steps.append).status == "completed"
    limit = 1.2 - excess
    leaves = np.arcsin(limit / 1.2) / pace
    comes_back = np.pi / pace - leaves
    # The hard part: no step ends beyond the bound.
    assert not any(leaves <= t <= comes_back for t in steps)
    narrow = problem(system, start, [0.0, end], range_bound=np.cos(limit), **tolerances)
    trajectory = solve("scipy", narrow)
    assert trajectory.status == "range left"
    assert abs(trajectory.states[-1, 1]) == pytest.approx(limit, rel=0, abs=1e-12)
    assert trajectory.times[-1] == pytest.approx(leaves, rel=0.05)


# A dip of 1e-6 rad lasts a millisecond; of 1e-9 rad, 40 microseconds. The accuracy of the time is
# that of θ2, divided by the small rate at which θ2 passes the bound.
