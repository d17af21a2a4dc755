"""heyoka's own loop ends with the deadline, and keeps a sample at a switch."""

from dataclasses import replace

import numpy as np
from support.switching import TIGHT, data, ligament, problem

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.inner_switches import InnerSwitches
from rbstab.integrate.heyoka.run import HeyokaRun
from rbstab.systems.modes import modes_of

LIGAMENTS = data(
    {"a": ligament(-1.0, damping=2.0), "b": ligament(1.0)},
    {"velocity": [1.1, 0.2, 0], "angular_velocity": [0.3, -0.2, 0.1]},
    {"duration": 4.0, "samples": 81},
)


def test_the_loop_ends_with_the_deadline():
    ticks = iter(range(10**6))
    given = problem(LIGAMENTS | {"integration": LIGAMENTS["integration"] | {"engine": "heyoka"}})
    run = HeyokaRun(given, None, Deadline(8.0, clock=lambda: float(next(ticks))))
    told: list[float] = []
    run.progress = told.append
    trajectory = run.result()
    assert trajectory.status == "time limit"
    # The clock ticks once a step.
    assert len(told) <= 8
    assert trajectory.times[-1] == told[-1]


def test_a_sample_at_a_switch_is_not_lost(monkeypatch):
    """heyoka's time there may be a part of the last digit before the sample, or behind it."""
    settings = LIGAMENTS["integration"] | TIGHT["heyoka"] | {"engine": "heyoka"}
    given = problem(LIGAMENTS | {"integration": settings})
    parts = []
    at_switch = InnerSwitches.at_switch

    def told(self, integrator, mode, direction):
        parts.append(integrator.dtime)
        return at_switch(self, integrator, mode, direction)

    monkeypatch.setattr(InnerSwitches, "at_switch", told)
    HeyokaRun(given, None, Deadline(60.0)).result()
    switches = [t for t, _ in parts if t < 4.0]
    # Both kinds are among them, or this test says nothing.
    assert min(part for _, part in parts) < 0 < max(part for _, part in parts)
    for switch in switches:
        times = np.array([0.0, switch - 1e-3, switch, 4.0])
        trajectory = HeyokaRun(replace(given, times=times), None, Deadline(60.0)).result()
        assert trajectory.times.tolist() == times.tolist()
        # It belongs to the phase before the switch.
        assert modes_of(trajectory.systems[2]) == modes_of(trajectory.systems[1])
