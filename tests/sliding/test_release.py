"""An axis that sticks on s = E is released when the force that holds it reaches its bound."""

import numpy as np
import pytest
from support.sliding import audit, paper_problem, solve_sliding

from rbstab.integrate.status import RunStatus

BOUND = 4000.0


@pytest.mark.parametrize("engine", ["heyoka", "scipy"])
def test_no_held_axis_is_held_by_more_than_its_bound(engine):
    """Other axes still cross, and at each crossing the equivalent force jumps."""
    problem = paper_problem(BOUND, duration=0.2, samples=201, stick_energy=1e9)
    run = solve_sliding(engine, problem)
    kinds = [str(kind) for _, _, kind in run.switches.transitions]
    assert kinds.count("release") >= 1
    pairs = zip(run.systems, run.states, strict=True)
    forces = np.array([system.observe(y).contact_force for system, y in pairs])
    assert np.abs(forces).max() <= BOUND * (1 + 1e-8)
    assert audit(run) < 1e-8


@pytest.mark.parametrize("engine", ["heyoka", "scipy"])
def test_a_released_axis_leaves_without_another_switch(engine):
    """While it is held for 0.13 s, E and F drift to 1e-16 m and 1e-13 m/s."""
    run = solve_sliding(engine, paper_problem(BOUND, duration=0.2, samples=201, stick_energy=1e9))
    assert run.status is RunStatus.COMPLETED
    times, axes = run.switches.switch_times, run.switches.switch_axes
    released = [(t, axis) for t, axis, kind in run.switches.transitions if str(kind) == "release"]
    for time, axis in released:
        later = times[(axes == axis) & (times >= time)]
        assert later[0] == time
        assert (later[1:] > time + 1e-6).all()
