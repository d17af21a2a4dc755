"""The course of a motion, from a run of the driver of switches."""

from dataclasses import replace

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.engine import initial_status, stop_reason
from rbstab.integrate.heyoka.mode_run import HeyokaModeRun
from rbstab.integrate.heyoka.symbols import energy_scale
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.status import RunStatus, UnfinishedRunError
from rbstab.integrate.switching.course import Course, Transition
from rbstab.integrate.switching.phases import switches
from rbstab.integrate.switching.saltation import NotDifferentiableError
from rbstab.integrate.switching.sliding_connector import drive_by_modes, follows_modes
from rbstab.systems.impact import side_of, stop_of


def course_of(problem: Problem, tolerance: float) -> Course:
    """Return the systems of a motion in their order.

    Args:
        problem: The problem; its elements may switch.
        tolerance: The tolerance with which the switches are found.

    Raises:
        UnfinishedRunError: The run did not complete.
        NotDifferentiableError: The motion is chaotic.
    """
    if not follows_modes(problem) and not switches(problem):
        return _scheduled(problem)
    status = initial_status(problem)
    if status is not None:
        detail = f"{stop_reason(status, problem, problem.start)} at t = {problem.times[0]:.9g} s"
        raise UnfinishedRunError(status, detail)
    _check_stop(problem)
    deadline = Deadline(problem.time_limit)
    runs: list[HeyokaModeRun] = []

    def integrate(given: Problem, told: Progress | None) -> Trajectory:
        run = HeyokaModeRun(given, told, deadline, scale=energy_scale(given))
        run.current.transitions = []
        runs.append(run)
        return run.result()

    exact = replace(problem, rtol=tolerance)
    with np.errstate(all="ignore"):
        if follows_modes(problem):
            found = drive_by_modes(exact, integrate, None, deadline)
        else:
            found = integrate(exact, None)
    if found.status is not RunStatus.COMPLETED:
        raise UnfinishedRunError(found.status, found.detail)
    _check_trusted(found, deadline)
    # A second run only shows how far the first one is trusted.
    current = runs[0].current
    assert current.transitions is not None
    transitions = tuple(current.transitions)
    first = transitions[0].before if transitions else current.phase.system
    return Course(first, transitions)


def _scheduled(problem: Problem) -> Course:
    """Return the systems of a motion that only breakpoints of inputs change."""
    first = system = problem.system_at_start()
    transitions = []
    for time in problem.breakpoints():
        assert problem.schedule is not None
        before, system = system, problem.schedule.system_at(system, time)
        transitions.append(Transition(time, (), before, system))
    return Course(first, tuple(transitions))


def _check_stop(problem: Problem) -> None:
    """Reject a motion that begins at a stop: it has no derivatives."""
    stop = stop_of(problem.system)
    if stop is None:
        return
    if side_of(problem.system, problem.start):
        raise NotDifferentiableError(
            f"{stop.name}: the body touches it at the start, so that its motion has no derivatives "
            "(expected a start inside)"
        )


def _check_trusted(found: Trajectory, deadline: Deadline) -> None:
    """Reject a chaotic motion: its derivatives grow exponentially, and predict nothing."""
    trusted = found.trusted_until if found.switches is None else found.switches.trusted_until
    end = float(found.times[-1])
    if trusted is None or trusted >= end:
        return
    if np.isnan(trusted):
        raise UnfinishedRunError(RunStatus.TIME_LIMIT, f"{deadline.reason}, in a second run")
    raise NotDifferentiableError(
        f"integration.duration: is {end:g} s, but the motion is chaotic. It is reproducible only "
        f"until t = {trusted:.4g} s; then its derivatives predict nothing (expected a shorter run)"
    )
