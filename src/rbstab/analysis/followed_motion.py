"""A motion at chosen times, and its derivatives along directions of the config."""

from collections.abc import Callable, Sequence

import numpy as np

from rbstab.analysis.sensitivity import Shifted, completed, tangent_along
from rbstab.integrate.heyoka.course import course_of
from rbstab.integrate.heyoka.variational import TOLERANCE, Levels, variational_system
from rbstab.integrate.problem import Problem
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array


def followed_motion(
    problem: Problem, times: Array, parts: Sequence[tuple[str, int]]
) -> Callable[[Shifted | None], Array]:
    """Return a function that computes parts of a motion at some times, to round-off.

    The function takes the numbers of the problem, shifted by ih along a direction, with
    h = `derivatives.STEP`. It returns the derivatives of the parts along this direction, or for
    None the parts, shape (times, parts).

    Args:
        problem: The problem; its own samples are not used.
        times: Ascending, s.
        parts: The vectors of a `Motion` by name, each with an axis.

    Raises:
        UnfinishedRunError: The run did not complete; the function may raise it, too.
        NotDifferentiableError: The motion is chaotic, or has no derivative along the direction.
    """
    course, grid = course_of(problem, TOLERANCE), np.unique([problem.times[0], *times])
    compiled = variational_system(course.first)

    def values(shifted: Shifted | None) -> Array:
        tangent = None if shifted is None else tangent_along(problem, shifted)
        trajectory = compiled.integrate(problem, course, grid, Levels(0.0), tangent)
        states = completed(trajectory, problem).states + 1j * STEP * trajectory.tangents
        system = problem.system if tangent is None else tangent.system
        motions = map(system.motion, states[-len(times) :])
        read = np.array([[getattr(m, vector)[axis] for vector, axis in parts] for m in motions])
        return read.real if tangent is None else read.imag / STEP

    return values
