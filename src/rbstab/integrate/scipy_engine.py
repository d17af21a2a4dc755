"""The default engine of single runs: SciPy's integrators, driven step by step."""

import warnings

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.implicit.integrate import integrate as integrate_by_steps
from rbstab.integrate.implicit.steps import python_stepper
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.scipy_run import ScipyRun
from rbstab.integrate.switching.phases import switches
from rbstab.integrate.switching.scipy_modes import ModeRun
from rbstab.integrate.switching.sliding_connector import drive_by_modes, follows_modes


def integrate(
    problem: Problem, progress: Progress | None = None, deadline: Deadline | None = None
) -> Trajectory:
    """Integrate a problem with its method (see `Engine`)."""
    deadline = deadline or Deadline(problem.time_limit)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        # Overflow and failed steps become statuses, so the warnings (LSODA's too) are not needed.
        warnings.simplefilter("ignore")
        if follows_modes(problem):
            return drive_by_modes(
                problem, lambda p, told: ModeRun(p, told, deadline).result(), progress, deadline
            )
        if problem.switching is not None:
            return integrate_by_steps(
                problem, lambda: python_stepper(problem.system), progress, deadline
            )
        if switches(problem):
            return ModeRun(problem, progress, deadline).result()
        return ScipyRun(problem, progress, deadline).result()
