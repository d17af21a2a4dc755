"""The compiled engine compiles each structure once, and no run affects a later one."""

import sys
from dataclasses import replace

import heyoka as hy
import numpy as np
import pytest
from support.hang_guard import within
from support.problems import bare_system, problem, solve
from support.systems import random_system

from rbstab.integrate.engines import EngineMissingError, engine
from rbstab.integrate.heyoka import run
from rbstab.integrate.heyoka.equations import compiled_equations
from rbstab.mechanics.body import Body
from rbstab.mechanics.numbers import square
from rbstab.systems.coordinates import ReducedCoordinates

TIMES = np.linspace(0.0, 0.5, 11)
RTOL = 1e-9  # heyoka compiles for each tolerance; this one has a low order and compiles quickly


def random_problem(seed, **changes):
    rng = np.random.default_rng(seed)
    system = random_system(rng, "free")
    start = np.concatenate([rng.normal(size=3) * 0.2, rng.normal(size=9)])
    return problem(system, start, TIMES, **({"rtol": RTOL} | changes))


def test_another_system_of_the_structure_is_not_compiled_again():
    first, second = random_problem(1), random_problem(2)
    compiled = compiled_equations(first.system, RTOL)
    solve("heyoka", first)
    assert compiled_equations(second.system, RTOL) is compiled
    trajectory = solve("heyoka", second)
    expected = solve("scipy", random_problem(2, rtol=1e-12))
    np.testing.assert_allclose(trajectory.states, expected.states, rtol=0, atol=1e-7)
    # The anchor is a parameter too, though it does not affect the states in Z.
    assert not np.array_equal(first.system.anchor, second.system.anchor)


def test_structure_tolerance_and_thread_each_have_their_own():
    system = random_problem(1).system
    compiled = compiled_equations(system, RTOL)
    assert compiled_equations(system, 1e-6) is not compiled
    tied = random_system(np.random.default_rng(1), "visco-elastic")
    assert compiled_equations(tied, RTOL) is not compiled
    held = replace(system, coordinates=ReducedCoordinates())
    assert compiled_equations(held, RTOL) is not compiled
    assert within(60.0, compiled_equations, system, RTOL) is not compiled
    assert compiled_equations(system, RTOL) is compiled


def leaving(**changes):
    system = bare_system(Body(2.0, np.diag([2.0, 1.5, 1.0]), np.array([0.1, 0.0, 0.2])))
    start = np.concatenate([np.zeros(3), [0.0, 4.0, 0.0], np.zeros(6)])
    return problem(system, start, TIMES, **({"rtol": RTOL} | changes))


def diverging():
    system = bare_system(Body(2.0, np.eye(3), np.zeros(3)), K_t=-1e10 * np.eye(3))
    return problem(system, np.concatenate([np.zeros(6), np.ones(6)]), TIMES, rtol=RTOL)


@pytest.mark.parametrize(
    ("before", "status"),
    [
        (leaving(), "range left"),
        (leaving(step_limit=1), "step limit"),
        (leaving(time_limit=1e-9), "time limit"),
        (diverging(), "diverged"),
        (leaving(range_bound=0.9), "range left"),
    ],
    ids=["range left", "step limit", "time limit", "diverged", "other bound"],
)
def test_a_stopped_run_leaves_nothing_behind(before, status):
    given = random_problem(3)
    alone = solve("heyoka", given)
    assert alone.status == "completed"
    assert solve("heyoka", before).status == status
    after = solve("heyoka", given)
    np.testing.assert_array_equal(after.states, alone.states)
    np.testing.assert_array_equal(after.lyapunov_change, alone.lyapunov_change)
    assert after.steps == alone.steps


def test_a_start_close_to_the_border_leaves_at_once_after_another_that_left():
    # It leaves while heyoka would still ignore the event: 1e-8 rad to the border, at 4 rad/s.
    border = np.cos(1.3)
    assert solve("heyoka", leaving(range_bound=border)).status == "range left"
    close = leaving(range_bound=border)
    close.start[1] = 1.3 - 1e-8
    trajectory = solve("heyoka", close)
    assert trajectory.status == "range left"
    assert trajectory.times[-1] == pytest.approx(1e-8 / 4.0, rel=1e-5)


def test_nothing_is_compiled_for_a_start_without_rates(monkeypatch):
    def refuse(*_):
        raise AssertionError("compiled")

    monkeypatch.setattr(run, "compiled_equations", refuse)
    given = leaving()
    given.start[3:6] = 1e200
    assert solve("heyoka", given).status == "diverged"


def test_missing_heyoka_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "heyoka", None)
    for module in ("engine", "run"):
        monkeypatch.delitem(sys.modules, f"rbstab.integrate.heyoka.{module}")
    with pytest.raises(EngineMissingError, match=r"engine 'heyoka' cannot be used here.*'scipy'"):
        engine("heyoka")
    # The other engine does not need heyoka.
    assert solve("scipy", random_problem(1)).status == "completed"


def test_a_square_that_passes_through_zero():
    """Taylor series of other powers divide by x. ∫x² dt from x = -1 to 0, and to 1."""
    x, integral = hy.make_vars("x", "integral")
    rates = [(x, hy.expression(1.0)), (integral, square(x))]
    integrator = hy.taylor_adaptive(rates, state=[-1.0, 0.0], tol=1e-15)
    for time, expected in ((1.0, 1 / 3), (2.0, 2 / 3)):
        integrator.propagate_until(time)
        assert integrator.state[1] == pytest.approx(expected, rel=1e-15)
