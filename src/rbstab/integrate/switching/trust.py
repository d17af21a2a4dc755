"""How far a motion that bounces is trusted: the time up to which double precision reproduces it.

A second run from a start that differs in the last digit shows it, for a sliding controller, ties
that bounce on s = E, and impacts against a stop.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rbstab.elements.sliding import Crossing
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH, THETA
from rbstab.systems.connector import by_modes
from rbstab.systems.impact import stop_of
from rbstab.systems.system import System

TRUST_TOLERANCE = 1e-4
"""If two runs differ by more than this times the largest entry, they are not reproducible."""

NEGLIGIBLE = 1e-9
"""rad, rad/s, m, m/s: a vector that never exceeds this contains only round-off."""

LEAST_CHANGE = 1e-20
"""The least change of a state at the start of the second run: the engine heyoka diverges from
states of rest that differ from zero by the smallest number of a computer."""

PREDICTABLE = 1000
"""The switches up to which a motion may be trusted. On s = E an error grows by e^0.15 at each, so
that 200 of them turn the last digit of a double into 1e-4 (docs/sliding.md)."""

Integrate = Callable[[Problem, Progress | None], Trajectory]
"""Integrates a problem whose sliding controller, if it has one, is by modes or implicit steps."""


def integrate_trusted(
    problem: Problem, integrate: Integrate, progress: Progress | None, deadline: Deadline
) -> Trajectory:
    """Integrate a problem, and find how far its motion is trusted if errors may grow in it.

    Args:
        problem: The problem.
        integrate: Integrates it with an engine.
        progress: Called after every step of the first run.
        deadline: The deadline of both runs.
    """
    if problem.switching is not None and not problem.switching.step:
        problem = replace(problem, system=with_connector_by_modes(problem))
    run = integrate(problem, progress)
    if not (problem.diagnosed and (_slides(problem) or stop_of(problem.system) is not None)):
        return run
    trusted = float(run.times[-1])
    # A body that meets no other thing than its stop needs several impacts.
    if _slides(problem) or run.impacts is None or run.impacts.counts[-1] > 1:
        trusted = _trusted_until(problem, run, integrate, deadline)
    return replace(run, trusted_until=trusted)


def with_connector_by_modes(problem: Problem) -> System:
    """Return the system of a problem with a sliding connector that has modes 0 and 1."""
    rules = problem.switching
    assert rules is not None
    return by_modes(problem.system, problem.start, layered=rules.layered, sticks=rules.sticks)


def _slides(problem: Problem) -> bool:
    """Return whether a motion slides on s = E; errors may grow in it, and beside a stop."""
    ties = (isinstance(element, Crossing) for element in problem.system.elements)
    return problem.switching is not None or any(ties)


def _trusted_until(
    problem: Problem, run: Trajectory, integrate: Integrate, deadline: Deadline
) -> float:
    """Return how far a run is trusted, from a second run; NaN if the deadline has ended the run."""
    if run.status is RunStatus.TIME_LIMIT:
        return np.nan
    # It is compared up to `PREDICTABLE` switches first: most motions are not trusted that far, and
    # the rest of them has most of the switches.
    counts = [len(run.times)]
    if run.switches is not None:
        first = int(np.searchsorted(run.switches.counts.sum(axis=1), PREDICTABLE)) + 1
        counts = sorted({min(first, counts[0]), counts[0]})
    trusted = np.nan
    for count in counts:
        trusted = _trusted_within(count, problem, run, integrate, deadline)
        if trusted != run.times[count - 1]:
            break
    return trusted


def _trusted_within(
    count: int, problem: Problem, run: Trajectory, integrate: Integrate, deadline: Deadline
) -> float:
    """Return how far the first samples of a run are trusted, from a second run to the last one."""
    times = problem.times[problem.times <= run.times[count - 1]]
    # A run that ended where it began shows nothing, and its neighbours may bounce without an end.
    if len(times) < 2:
        return float(run.times[0])
    samples = deadline.samples
    start = np.maximum(np.nextafter(problem.start, np.inf), problem.start + LEAST_CHANGE)
    if stop_of(problem.system) is not None and problem.start[PITCH]:
        # Beyond its stop a body cannot start.
        start[PITCH] = np.nextafter(problem.start[PITCH], 0.0)
    second = integrate(replace(problem, start=start, times=times, diagnosed=False), None)
    deadline.samples = samples
    second = replace(second, states=_compared_states(run, second))
    return trusted_until(run, second, problem.system.coordinates.size)


def trusted_until(run: Trajectory, second: Trajectory, size: int = 12) -> float:
    """Return the time of the last sample that does not depend on the last digit of the start.

    The trusted time ends when two runs differ by more than `TRUST_TOLERANCE` times the largest
    value of Θ or q, Ω, E or F (X or V). After that, both runs are equally valid in doubles.

    Args:
        run: The run.
        second: A second run, from a start that differs in its last digits.
        size: The number of states that are compared: those of the body.

    Returns:
        The time, s. It is NaN if the deadline ends the second run before the two runs differ:
        then the time is not known.
    """
    # The largest value is taken over all axes, because a held axis contains only round-off.
    states = run.states[:, :size]
    # Each vector has three states, but a quaternion in the place of Θ has four.
    begins = np.array([0, *range(3 + size % 3, size, 3)])
    largest = np.maximum.reduceat(np.abs(states).max(axis=0), begins)
    scale = np.repeat(np.maximum(largest, NEGLIGIBLE), np.diff(begins, append=size))
    count = min(len(run.times), len(second.times))
    differs = run.times[:count] != second.times[:count]
    common = int(differs.argmax()) if differs.any() else count
    differences = np.abs(second.states[:common, :size] - states[:common])
    wrong = ~(differences <= TRUST_TOLERANCE * scale).all(axis=1)
    good = int(wrong.argmax()) if wrong.any() else common
    trusted = float(run.times[max(good - 1, 0)])
    unknown = second.status is RunStatus.TIME_LIMIT and good == common
    return np.nan if unknown and trusted < run.times[-1] else trusted


def _compared_states(run: Trajectory, second: Trajectory) -> Array:
    """Return the states of a second run, with those of the first at samples beside an impact."""
    if run.impacts is None or second.impacts is None:
        return second.states
    # The rates jump there. So where one sample lies between an impact of the one run and the same
    # impact of the other, they cannot be compared, however close the two impacts are. Θ does not
    # jump, so it tells whether it is the same impact.
    count = min(len(run.times), len(second.times))
    differ = run.impacts.counts[:count] != second.impacts.counts[:count]
    second_Theta, Theta = second.states[:count, THETA], run.states[:count, THETA]
    near = (np.abs(second_Theta - Theta) <= TRUST_TOLERANCE * np.abs(Theta).max()).all(axis=1)
    beside = differ & ~np.append(differ[1:], False) & near
    states = second.states.copy()
    states[:count][beside] = run.states[:count][beside]
    return states
