"""A step is made again if it ends with an axis on the wrong side of its surface.

heyoka hardly ever misses a crossing, so the tests provoke it: some events are ignored. The rest of
the run must be as it is without that.
"""

from dataclasses import replace

import numpy as np
import pytest
from support.sliding import ball_in_a_V, solve_sliding, turning_balls

from rbstab.integrate.heyoka.inner_switches import InnerSwitches
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching.phase import Phase


@pytest.fixture
def ignore(monkeypatch):
    """Let events of the given numbers do nothing, and return the list of events."""
    at_switch, reached = InnerSwitches.at_switch, []

    def install(numbers):
        def disturbed(run, integrator, mode, direction):
            reached.append(integrator.time)
            return len(reached) in numbers or at_switch(run, integrator, mode, direction)

        monkeypatch.setattr(InnerSwitches, "at_switch", disturbed)
        return reached

    return install


def balls(X, V, times):
    """Return three balls in a V without loads."""
    still = np.zeros(3)
    return ball_in_a_V(2.0, 30.0, still, still, np.array(X), np.array(V), times)


def run_of(problem):
    """Run once, without the second run that finds how far to trust the first."""
    return solve_sliding("heyoka", replace(problem, diagnosed=False))


def same(disturbed, undisturbed, within):
    run, other = disturbed.switches, undisturbed.switches
    assert disturbed.status is RunStatus.COMPLETED
    assert run.switch_axes.tolist() == other.switch_axes.tolist()
    assert run.switch_times == pytest.approx(other.switch_times, abs=within)
    assert run.counts.tolist() == other.counts.tolist()
    assert run.transitions == [
        (pytest.approx(time, abs=within), axis, kind) for time, axis, kind in other.transitions
    ]
    assert run.modes.tolist() == other.modes.tolist()
    assert disturbed.states == pytest.approx(undisturbed.states, abs=1e3 * within)


@pytest.mark.parametrize("numbers", [{1}, {2, 3}, {5, 8, 12}])
def test_an_axis_on_the_wrong_side_of_the_position(ignore, numbers):
    """The run restores the time and the state, and goes on with shorter steps."""
    # No crossing is at a sample.
    problem = turning_balls(np.linspace(0, 1.97, 11))
    reached = ignore(set())
    undisturbed = run_of(problem)
    events = len(reached)
    reached.clear()
    ignore(numbers)
    disturbed = run_of(problem)
    # Each switch is found up to 1e-12 of its flight, and an error moves all later ones.
    same(disturbed, undisturbed, 1e-11)
    # An ignored event is found again, or its switch is seen at the begin of a step.
    assert len(reached) >= events
    assert disturbed.steps >= undisturbed.steps


@pytest.mark.parametrize("numbers", [{4}, {20, 31}])
def test_a_missed_bounce_of_a_microsecond(ignore, numbers):
    """It is found by the sign of E alone, which is smaller than any bound of round-off."""
    problem = balls([1e-18] * 3, [1e-5, 1.3e-5, 0.7e-5], np.array([0.0, 2e-5]))
    undisturbed = run_of(problem)
    ignore(numbers)
    disturbed = run_of(problem)
    times = undisturbed.switches.switch_times
    assert len(times) > 40
    assert disturbed.switches.switch_times == pytest.approx(times, rel=1e-9)
    assert disturbed.switches.switch_axes.tolist() == undisturbed.switches.switch_axes.tolist()


@pytest.mark.parametrize("samples", [2, 5])
def test_a_crossing_whose_event_is_never_reported(ignore, samples):
    """Ever shorter steps lead to the crossing, which is then seen at the begin of a step."""
    problem = balls([0.3, 5.0, 5.0], [0.0] * 3, np.linspace(0, 0.3, samples))
    undisturbed = run_of(problem)
    assert undisturbed.switches.counts[-1].tolist() == [1, 0, 0]
    ignore(range(1, 10_000))
    same(run_of(problem), undisturbed, 1e-12)


def test_a_crossing_that_cannot_be_found_ends_the_run(ignore, monkeypatch):
    """The last sample is the last sound state."""
    problem = balls([0.3, 5.0, 5.0], [0.0] * 3, np.linspace(0, 1, 5))
    ignore(range(1, 10_000))
    monkeypatch.setattr(Phase, "coinciding", lambda *_: np.zeros(0, dtype=int))
    run = run_of(problem)
    assert run.status is RunStatus.SOLVER_FAILURE
    assert run.times[-1] < np.sqrt(2 * 0.3 / 15) + 1e-12
    assert run.states[-1, 6] == pytest.approx(0.3 - 7.5 * run.times[-1] ** 2, abs=1e-12)
    assert run.switches.modes[-1].tolist() == [1, 1, 1]
    assert run.switches.counts[-1].tolist() == [0, 0, 0]
    assert run.steps < 5000
