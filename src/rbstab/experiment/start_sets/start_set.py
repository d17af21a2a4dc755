"""The set of the starts of a config whose initial state has tolerances."""

from collections.abc import Sequence

from rbstab.config.numbers import replaced
from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance
from rbstab.experiment.convergence.enclosed_system import start_set
from rbstab.mechanics.numbers import Array
from rbstab.proof.exact.expr import variable
from rbstab.proof.motion.monomials import Monomials, monomials_up_to
from rbstab.proof.motion.motion_set import MotionSet

MAX_DEGREE = 6
"""The highest degree in z."""

MAX_MONOMIALS = 210
"""The most monomials in z: with more numbers that have a tolerance, the degree is lower."""


def monomials_of(variables: int) -> Monomials:
    """Return the monomials in z for a number of tolerances."""
    degree = MAX_DEGREE
    while degree > 1 and len(Monomials(variables, degree)) > MAX_MONOMIALS:
        degree -= 1
    return monomials_up_to(variables, degree)


def start_set_of(config: Config, tolerances: Sequence[Tolerance], scale: Array) -> MotionSet | None:
    """Return the set of all starts, as the only one.

    The number with the i-th tolerance is middle + radius z_i, with |z_i| <= 1.

    Args:
        config: The config.
        tolerances: Tolerances of its initial state.
        scale: The size of each state, shape (n,).

    Returns:
        The set; None if the starts have no bounds.

    Raises:
        ValueError: There is no tolerance, or one is not of the initial state.
    """
    if not tolerances or any(one.section != "initial" for one in tolerances):
        raise ValueError("a set of starts needs tolerances of the initial state, and no others")
    count = len(tolerances)
    numbers = {
        path: one.middle + variable(k) * one.radius
        for k, one in enumerate(tolerances)
        for path in one.entry.paths
    }
    return start_set(replaced(config, numbers), monomials_of(count), scale)
