"""Limits end a run with switching, and a crossing can overload and release held axes."""

from dataclasses import replace

import numpy as np
import pytest
from support.problems import each_engine
from support.sliding import (
    by_modes,
    connector,
    paper_problem,
    sides_and_holds,
    solve_sliding,
    turning_balls,
)

from rbstab.systems.connector import with_connector
from rbstab.systems.filippov import after_events


@each_engine
@pytest.mark.parametrize(("excess", "status"), [(1e-6, "range left"), (-1e-6, "completed")])
def test_a_dip_below_the_bound_between_two_steps_is_noticed(engine, excess, status):
    """θ2 = (Ω/ω)exp(-t/2)sin ωt has its peak at tan ωt = 2ω, while the axes bounce."""
    omega = np.sqrt(0.75)
    peak_time = np.arctan(2 * omega) / omega
    peak = 2.0 / omega * np.exp(-peak_time / 2) * np.sin(omega * peak_time)
    problem = replace(
        turning_balls(np.linspace(0, 2, 3), 2.0), range_bound=float(np.cos(peak - excess))
    )
    run = solve_sliding(engine, problem)
    assert run.status == status
    if excess > 0:
        # θ2 passes the bound √(2 excess/|θ''|) before its peak.
        before = np.sqrt(2 * excess / peak)
        assert run.times[-1] == pytest.approx(peak_time - before, abs=1e-3 * before)


def crossed(bounds):
    """Let the third axis cross, while the others are held.

    Returns:
        The sides and the holds after it, the force and the acceleration of each axis.
    """
    problem = paper_problem(1.0, duration=1.0, samples=2, stick_energy=1.0)
    sliding = replace(connector(1.0), K_s=np.array(bounds))
    problem = replace(problem, system=with_connector(problem.system, sliding))
    y = np.array([0.2, -0.3, 0.4, 9.0, 12.0, -7.0, 0, 0, 0, 0, 0, 0.5, 0, 0])
    system, after = after_events(by_modes(problem, (0, 0, 1), (1, 1, 0)), y, [2])
    assert after == pytest.approx(y, abs=1e-12)
    force, acceleration = system.observe(y[:12]).contact_force, system.rates(y[:12])[9:12]
    return *sides_and_holds(system), force, acceleration


def test_a_crossing_that_overloads_two_held_axes_releases_both():
    """Each leaves to the side to which its load exceeds its bound."""
    sides, held, _, acceleration = crossed([1.0, 1.0, 50.0])
    assert held == [0, 0, 0]
    assert sides[2] == 1
    for axis in (0, 1):
        assert sides[axis] * acceleration[axis] > 0


def test_a_crossing_that_overloads_none_releases_none():
    sides, held, force, acceleration = crossed([1e5, 1e5, 50.0])
    assert held == [1, 1, 0]
    assert sides == [0, 0, 1]
    assert (np.abs(force[:2]) < 1e5).all()
    assert acceleration[:2] == pytest.approx(0, abs=1e-9)
