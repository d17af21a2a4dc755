"""The choice of the driver for the law of a sliding connector, for any engine."""

from collections.abc import Callable

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.switching.driver import drive
from rbstab.integrate.switching.filippov import FilippovDriver, Flow
from rbstab.integrate.switching.implicit import ImplicitDriver, Stepper


def drive_sliding(
    problem: Problem,
    make_flow: Callable[[Problem], Flow],
    make_stepper: Callable[[], Stepper],
    progress: Progress | None,
    deadline: Deadline,
) -> Trajectory:
    """Integrate a problem with a sliding connector under its law.

    Args:
        problem: The problem; its `switching` is the law.
        make_flow: Returns the engine's smooth flow of a problem. It is called for the laws that
            locate each switch.
        make_stepper: Returns the engine's stepper. It is called for the implicit law.
        progress: Called with the time of each sample.
        deadline: The deadline of the run, and of the second run that diagnoses it.
    """
    switching = problem.switching
    assert switching is not None
    if switching.step:
        stepper = make_stepper()
        return drive(
            problem, lambda p: ImplicitDriver(p, switching, stepper, deadline), progress, deadline
        )
    # Each run needs its own flow: a flow counts its steps, and their number is limited.
    return drive(
        problem, lambda p: FilippovDriver(p, switching, make_flow(p), deadline), progress, deadline
    )
