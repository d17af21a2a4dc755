"""A motion at chosen times, and its derivatives along directions of the config."""

from collections.abc import Sequence

import numpy as np

from rbstab.analysis.sensitivity import Shifted, completed, tangent_along
from rbstab.integrate.heyoka.course import course_of
from rbstab.integrate.heyoka.variational import TOLERANCE, Levels, variational_system
from rbstab.integrate.problem import Problem
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array


class FollowedMotion:
    """The motion of a problem at some times, to round-off.

    Args:
        problem: The problem; its own samples are not used.
        times: Ascending, s.

    Raises:
        UnfinishedRunError: The run did not complete.
        NotDifferentiableError: The motion is chaotic.
    """

    def __init__(self, problem: Problem, times: Array) -> None:
        self.problem, self.times = problem, times
        self.course = course_of(problem, TOLERANCE)

    def values(self, parts: Sequence[tuple[str, int]], shifted: Shifted | None = None) -> Array:
        """Return parts of the motion at the times, or their derivatives along a direction.

        Args:
            parts: The vectors of a `Motion` by name, each with an axis.
            shifted: The numbers of the problem, shifted by ih along the direction, with
                h = `derivatives.STEP`.

        Returns:
            Shape (times, parts).

        Raises:
            UnfinishedRunError: The run did not complete.
            NotDifferentiableError: The motion has no derivative along the direction.
        """
        problem, compiled = self.problem, variational_system(self.course.first)
        tangent = None if shifted is None else tangent_along(problem, shifted)
        grid = np.unique([problem.times[0], *self.times])
        trajectory = compiled.integrate(problem, self.course, grid, Levels(0.0), tangent)
        found = completed(trajectory, problem)
        system = problem.system if tangent is None else tangent.system
        states = (found.states + 1j * STEP * found.tangents)[-len(self.times) :]
        motions = map(system.motion, states)
        values = np.array([[getattr(m, vector)[axis] for vector, axis in parts] for m in motions])
        return values.real if tangent is None else values.imag / STEP
