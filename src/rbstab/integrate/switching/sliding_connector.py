"""A sliding controller, whose axes are modes, and how far a motion that bounces is trusted.

The driver of modes follows its connector like any other element. A second run finds how far a
motion is trusted, also one with ties that bounce on s = E, or with impacts against a stop.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rbstab.elements.sliding_ties import (
    AtContact,
    CrossingConnector,
    CrossingTie,
    FilippovConnector,
    LayeredConnector,
    StickingConnector,
)
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching.trust import TRUST_TOLERANCE, perturbed_start, trusted_until
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH, THETA
from rbstab.systems.connector import connector_of, with_connector
from rbstab.systems.filippov import START_TOLERANCE
from rbstab.systems.impact import stop_of
from rbstab.systems.system import System

ModeIntegration = Callable[[Problem, Progress | None], Trajectory]
"""An engine for problems whose elements switch."""

LEAST_CHANGE = 1e-20
"""The least change of a state at the start of the second run: the engine heyoka diverges from
states of rest that differ from zero by the smallest number of a computer."""


PREDICTABLE = 1000
"""The switches up to which a motion may be trusted. On s = E an error grows by e^0.15 at each, so
that 200 of them turn the last digit of a double into 1e-4 (docs/sliding.md)."""


def follows_modes(problem: Problem) -> bool:
    """Return whether `drive_by_modes` integrates a problem.

    It follows a sliding connector, ties whose axes bounce on s = E, and stops. Implicit steps of a
    connector have no events to follow.
    """
    system = problem.system
    if problem.switching is None:
        return _has_ties_that_bounce(system) or stop_of(system) is not None
    return not problem.switching.step


def drive_by_modes(
    problem: Problem, integrate: ModeIntegration, progress: Progress | None, deadline: Deadline
) -> Trajectory:
    """Integrate a problem that `follows_modes`, and find how far it is trusted.

    Args:
        problem: The problem.
        integrate: Integrates a problem whose elements switch, with the switches of its connector.
        progress: Called after every step of the first run.
        deadline: The deadline of both runs.
    """
    by_modes = problem
    if problem.switching is not None:
        by_modes = replace(problem, system=with_connector_by_modes(problem))
    run = integrate(by_modes, progress)
    if not problem.diagnosed:
        return run
    if _may_be_chaotic(by_modes, run):
        trusted = _trusted_until(by_modes, run, integrate, deadline)
    else:
        trusted = float(run.times[-1])
    if run.switches is not None:
        return replace(run, switches=run.switches._replace(trusted_until=trusted))
    return replace(run, trusted_until=trusted)


def _has_ties_that_bounce(system: System) -> bool:
    return any(isinstance(element, CrossingTie) for element in system.elements)


def _may_be_chaotic(problem: Problem, run: Trajectory) -> bool:
    """Return whether errors may grow in a run, so that a second one has to show how far they do.

    A body that meets no other thing than its stop needs several impacts for that.
    """
    if problem.switching is not None or _has_ties_that_bounce(problem.system):
        return True
    return run.impacts is None or bool(run.impacts.counts[-1] > 1)


def _trusted_until(
    problem: Problem, run: Trajectory, integrate: ModeIntegration, deadline: Deadline
) -> float:
    """Return how far a run is trusted, from a second run.

    It is compared up to `PREDICTABLE` switches first: most motions are not trusted that far, and
    the rest of them has most of the switches. It is NaN if the deadline has ended the run.
    """
    if run.status is RunStatus.TIME_LIMIT:
        return np.nan
    all_samples = len(run.times)
    first = all_samples
    if run.switches is not None:
        counts = run.switches.counts.sum(axis=1)
        first = min(int(np.searchsorted(counts, PREDICTABLE)) + 1, all_samples)
    trusted = _trusted_within(first, problem, run, integrate, deadline)
    if first < all_samples and trusted == run.times[first - 1]:
        return _trusted_within(all_samples, problem, run, integrate, deadline)
    return trusted


def _trusted_within(
    count: int, problem: Problem, run: Trajectory, integrate: ModeIntegration, deadline: Deadline
) -> float:
    """Return how far the first samples of a run are trusted, from a second run to the last one."""
    times = problem.times[problem.times <= run.times[count - 1]]
    # A run that ended where it began shows nothing, and its neighbours may bounce without an end.
    if len(times) < 2:
        return float(run.times[0])
    samples = deadline.samples
    start = perturbed_start(problem, LEAST_CHANGE)
    if stop_of(problem.system) is not None and problem.start[PITCH]:
        # Beyond its stop a body cannot start.
        start[PITCH] = np.nextafter(problem.start[PITCH], 0.0)
    second = integrate(replace(problem, start=start, times=times, diagnosed=False), None)
    deadline.samples = samples
    ends = [None] * (len(second.times) - 1) + [second.status]
    states = _compared_states(run, second)
    rows = zip(second.times.tolist(), states, ends, strict=True)
    return trusted_until(run, rows, problem.system.coordinates.size)


def _compared_states(run: Trajectory, second: Trajectory) -> Array:
    """Return the states of a second run, with those of the first at samples beside an impact.

    The rates jump there. So where one sample lies between an impact of the one run and the same
    impact of the other, they cannot be compared, however close the two impacts are. Θ does not
    jump, so it tells whether it is the same impact.
    """
    if run.impacts is None or second.impacts is None:
        return second.states
    count = min(len(run.times), len(second.times))
    differ = run.impacts.counts[:count] != second.impacts.counts[:count]
    theirs, ours = second.states[:count, THETA], run.states[:count, THETA]
    near = (np.abs(theirs - ours) <= TRUST_TOLERANCE * np.abs(ours).max()).all(axis=1)
    beside = differ & ~np.append(differ[1:], False) & near
    states = second.states.copy()
    states[:count][beside] = run.states[:count][beside]
    return states


def with_connector_by_modes(problem: Problem) -> System:
    """Return the system of a problem with a sliding connector that has modes 0 and 1."""
    system, switching = problem.system, problem.switching
    assert switching is not None
    if switching.step:
        raise ValueError("implicit steps are those of a sliding connector alone")
    connector = connector_of(system)
    kind: type[AtContact] = CrossingConnector
    if switching.layered:
        kind = LayeredConnector
    elif connector.rate_weight:
        kind = FilippovConnector
    elif switching.sticks or _begins_at_rest(problem):
        kind = StickingConnector
    changed = kind(
        K_s=connector.K_s,
        rate_weight=connector.rate_weight,
        slope=connector.slope,
        layer_width=connector.layer_width,
    )
    return with_connector(system, changed)


def _begins_at_rest(problem: Problem) -> bool:
    """Return whether an axis of the contact point begins at E = F = 0, and so may be held.

    No axis is held on s = E beside a stop: each impact would throw it off, to bounce again.
    """
    if stop_of(problem.system) is not None:
        return False
    motion = problem.system.motion(problem.start)
    at_rest = np.maximum(np.abs(motion.E), np.abs(motion.F)) <= START_TOLERANCE
    return bool(at_rest.any())
