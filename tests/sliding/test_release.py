"""An axis of s = E that is stuck lets go where the force that holds it would leave its box."""

import numpy as np
import pytest
from support.sliding import audit, follow, paper_problem

from rbstab.integrate.status import RunStatus

BOUND = 4000.0


@pytest.mark.parametrize("engine", ["heyoka", "scipy"])
def test_no_held_axis_is_held_by_more_than_its_bound(engine):
    """Other axes still cross, and each crossing makes the equivalent force jump."""
    problem = paper_problem(BOUND, duration=0.2, samples=201, stick_energy=1e9)
    run = follow(engine, problem)
    kinds = [str(kind) for _, _, kind in run.switches.transitions]
    assert kinds.count("release") >= 1
    pairs = zip(run.systems, run.states, strict=True)
    forces = np.array([system.observe(y).contact_force for system, y in pairs])
    assert np.abs(forces).max() <= BOUND * (1 + 1e-8)
    assert audit(run) < 1e-8


@pytest.mark.parametrize("engine", ["heyoka", "scipy"])
def test_a_released_axis_leaves_without_another_switch(engine):
    """It is held for 0.13 s, in which E and F drift to some 1e-16 m and 1e-13 m/s."""
    run = follow(engine, paper_problem(BOUND, duration=0.2, samples=201, stick_energy=1e9))
    assert run.status is RunStatus.COMPLETED
    times, axes = run.switches.switch_times, run.switches.switch_axes
    released = [(t, axis) for t, axis, kind in run.switches.transitions if str(kind) == "release"]
    for time, axis in released:
        later = times[(axes == axis) & (times >= time)]
        assert later[0] == time
        assert (later[1:] > time + 1e-6).all()
