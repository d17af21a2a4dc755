"""The laws of a sliding connector: which follower goes with which, for any engine."""

from collections.abc import Callable

from rbstab.integrate.problem import Problem, Progress, Switching, Trajectory
from rbstab.integrate.switching.driver import follow
from rbstab.integrate.switching.filippov import FilippovDriver, Flow
from rbstab.integrate.switching.implicit import ImplicitDriver, Stepper


def drive_sliding(
    problem: Problem,
    switching: Switching,
    flow: Callable[[Problem], Flow],
    stepper: Callable[[], Stepper],
    progress: Progress | None,
) -> Trajectory:
    """Follows a problem with a sliding connector under its law.

    Args:
        problem: The problem.
        switching: Its law.
        flow: Makes an engine's smooth flow of a problem, for the laws that are followed switch by
            switch.
        stepper: Makes an engine's steps of the implicit law.
        progress: Called with the time of every sample.
    """
    if switching.step:
        steps = stepper()
        return follow(problem, lambda p: ImplicitDriver(p, switching, steps), progress)
    # Each run has a flow of its own: a flow counts its steps, which are limited.
    return follow(problem, lambda p: FilippovDriver(p, switching, flow(p)), progress)
