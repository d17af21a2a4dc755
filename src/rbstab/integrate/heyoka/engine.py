"""The compiled engine: Taylor integration by heyoka, compiled once per structure.

The parameters of a system become the `par[]` of the compiled integrator, apart from some zeros
(`compiled_zeros`). So one compilation serves all systems of a structure with the same zeros. The
dense output is as accurate as the steps.
"""

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.run import HeyokaRun
from rbstab.integrate.heyoka.symbols import energy_scale, fitting_scale
from rbstab.integrate.implicit import ImplicitRun
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.switching.trust import integrate_trusted


def integrate(
    problem: Problem, progress: Progress | None = None, deadline: Deadline | None = None
) -> Trajectory:
    """Integrate a problem with heyoka (an `Engine`); `rtol` is its only tolerance.

    Args:
        problem: The problem.
        progress: As `Engine`.
        deadline: As `Engine`.
    """
    deadline = deadline or Deadline(problem.time_limit)

    def run(given: Problem, told: Progress | None) -> Trajectory:
        if given.switching is not None and given.switching.step:
            return ImplicitRun(given, told, deadline).result()
        scale = energy_scale(given)
        trajectory = HeyokaRun(given, told, deadline, scale=scale).result()
        fitting = fitting_scale(given, trajectory, scale)
        if fitting == scale:
            return trajectory
        return HeyokaRun(given, told, deadline, scale=fitting).result()

    with np.errstate(all="ignore"):
        return integrate_trusted(problem, run, progress, deadline)
