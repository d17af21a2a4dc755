"""heyoka's own loop makes the same steps as Python code that makes one step at a time."""

from dataclasses import replace

import numpy as np
import pytest
from support.switching import TIGHT, data, guard, ligament, problem

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.inner_switches import InnerSwitches
from rbstab.integrate.heyoka.run import MUTED, STEP_REDUCTION, HeyokaRun
from rbstab.systems.modes import modes_of

LOAD = {
    "kind": "input",
    "quantity": "force",
    "point": [0, 0, 0],
    "direction": [1, 0, 0],
    "amplitude": 5.0,
    "signal": {"kind": "table", "times": [0.0, 0.7, 0.7], "values": [1.0, 1.0, -1.0]},
}
"""A force that jumps at 0.7 s, which is a sample."""

CASES = {
    "ligaments": data(
        {"a": ligament(-1.0, damping=2.0), "b": ligament(1.0)},
        {"velocity": [1.1, 0.2, 0], "angular_velocity": [0.3, -0.2, 0.1]},
        {"duration": 4.0, "samples": 81},
    ),
    "a switch at a sample": data(
        {"soft": guard("stiff", 40.0)},
        {"angular_velocity": [0, 1.0, 0]},
        {"duration": 0.6, "samples": 7},
    ),
    "a breakpoint at a sample": data(
        {"a": ligament(-1.0), "push": LOAD},
        {"velocity": [1.1, 0, 0]},
        {"duration": 2.1, "samples": 22},
    ),
}


def run(config, steps, monkeypatch, muted=False):
    """Return a run in heyoka's loop, or step by step, and how often the loop began."""
    settings = config["integration"] | TIGHT["heyoka"] | {"engine": "heyoka"}
    one = HeyokaRun(problem(config | {"integration": settings}), None, Deadline(60.0))
    begun = []
    with monkeypatch.context() as patch:
        if steps == "single":
            patch.setattr(HeyokaRun, "_steps_to", HeyokaRun._one_step_to)
        else:
            loop = HeyokaRun._steps_to

            def counted(self, last):
                begun.append(self.integrator.time)
                return loop(self, last)

            patch.setattr(HeyokaRun, "_steps_to", counted)
        if muted:
            begin = HeyokaRun.begin

            def hidden(self):
                begin(self)
                self.integrator.pars[-len(self.offsets) :] = MUTED

            patch.setattr(HeyokaRun, "begin", hidden)
        return one, one.result(), len(begun)


@pytest.mark.parametrize("name", CASES)
def test_the_loop_makes_the_same_steps(name, monkeypatch):
    single, expected, none = run(CASES[name], "single", monkeypatch)
    looped, found, begun = run(CASES[name], "loop", monkeypatch)
    assert (expected.status, found.status) == ("completed", "completed")
    assert none == 0
    assert begun > 0
    # Each phase begins once in the loop; after a switch, a step of no length may come first.
    assert begun <= 2 * (looped.driver.count + len(found.breakpoints) + 1)
    assert looped.driver.count == single.driver.count > 0
    # A single step may end a last digit before the end, and then another one follows.
    assert 0 <= expected.steps - found.steps <= 1
    assert found.times.tolist() == expected.times.tolist()
    # Samples are the same polynomials, evaluated in another order.
    np.testing.assert_allclose(found.states, expected.states, rtol=0, atol=1e-13)
    modes, expected_modes = ([modes_of(s) for s in t.systems] for t in (found, expected))
    assert modes == expected_modes
    assert found.breakpoints.tolist() == expected.breakpoints.tolist()


def test_samples_before_a_missed_switch_are_kept(monkeypatch):
    """The loop goes back to the begin of the step that missed it, and not further."""
    config = CASES["ligaments"]
    _, expected, _ = run(config, "single", monkeypatch, muted=True)
    looped, found, begun = run(config, "loop", monkeypatch, muted=True)
    assert begun > 0
    assert looped.max_step < STEP_REDUCTION * config["integration"]["duration"]
    assert found.times.tolist() == expected.times.tolist()
    np.testing.assert_allclose(found.states, expected.states, rtol=0, atol=1e-13)


def test_the_loop_ends_with_the_deadline(monkeypatch):
    ticks = iter(range(10**6))
    config = CASES["ligaments"]
    given = problem(config | {"integration": config["integration"] | {"engine": "heyoka"}})
    one = HeyokaRun(given, None, Deadline(8.0, clock=lambda: float(next(ticks))))
    told: list[float] = []
    one.progress = told.append
    found = one.result()
    assert found.status == "time limit"
    # The clock ticks once a step.
    assert len(told) <= 8
    assert found.times[-1] == told[-1]


def test_a_sample_at_a_switch_is_not_lost(monkeypatch):
    """heyoka's time there may be a part of the last digit before the sample, or behind it."""
    config = CASES["ligaments"]
    settings = config["integration"] | TIGHT["heyoka"] | {"engine": "heyoka"}
    given = problem(config | {"integration": settings})
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
        found = HeyokaRun(replace(given, times=times), None, Deadline(60.0)).result()
        assert found.times.tolist() == times.tolist()
        # It belongs to the phase before the switch.
        assert modes_of(found.systems[2]) == modes_of(found.systems[1])
