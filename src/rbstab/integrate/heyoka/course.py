"""The course of a motion, from a run of the driver of switches."""

from dataclasses import replace

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.run import HeyokaRun
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.run import check_start
from rbstab.integrate.status import RunStatus, StopRun, UnfinishedRunError
from rbstab.integrate.switching.course import Course, Transition
from rbstab.integrate.switching.saltation import NotDifferentiableError
from rbstab.integrate.switching.trust import integrate_trusted
from rbstab.systems.impact import side_of, stop_of
from rbstab.systems.modes import has_modes


def course_of(problem: Problem, tolerance: float) -> Course:
    """Return the systems of a motion in their order.

    Args:
        problem: The problem; its elements may switch.
        tolerance: The tolerance with which the switches are found.

    Raises:
        UnfinishedRunError: The run did not complete.
        NotDifferentiableError: The motion is chaotic.
    """
    if problem.switching is None and not has_modes(problem.system):
        return _scheduled(problem)
    try:
        check_start(problem)
    except StopRun as stop:
        detail = f"{stop} at t = {problem.times[0]:.9g} s"
        raise UnfinishedRunError(stop.status, detail) from stop
    _check_stop(problem)
    deadline = Deadline(problem.time_limit)
    runs: list[HeyokaRun] = []

    def integrate(given: Problem, told: Progress | None) -> Trajectory:
        run = HeyokaRun(given, told, deadline)
        run.driver.transitions = []
        runs.append(run)
        return run.result()

    with np.errstate(all="ignore"):
        trajectory = integrate_trusted(replace(problem, rtol=tolerance), integrate, None, deadline)
    if trajectory.status is not RunStatus.COMPLETED:
        raise UnfinishedRunError(trajectory.status, trajectory.detail)
    _check_trusted(trajectory, deadline)
    # A second run only shows how far the first one is trusted.
    driver = runs[0].driver
    assert driver.transitions is not None
    transitions = tuple(driver.transitions)
    first = transitions[0].before if transitions else driver.phase.system
    return Course(first, transitions)


def _scheduled(problem: Problem) -> Course:
    """Return the systems of a motion that only breakpoints of inputs change."""
    first = system = problem.system_at_start()
    transitions = []
    for time in problem.breakpoints():
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


def _check_trusted(trajectory: Trajectory, deadline: Deadline) -> None:
    """Reject a chaotic motion: its derivatives grow exponentially, and predict nothing."""
    trusted, end = trajectory.trusted_until, float(trajectory.times[-1])
    if trusted is None or trusted >= end:
        return
    if np.isnan(trusted):
        raise UnfinishedRunError(RunStatus.TIME_LIMIT, f"{deadline.reason}, in a second run")
    raise NotDifferentiableError(
        f"integration.duration: is {end:g} s, but the motion is chaotic. It is reproducible only "
        f"until t = {trusted:.4g} s; then its derivatives predict nothing (expected a shorter run)"
    )
