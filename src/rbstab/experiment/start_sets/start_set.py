"""The set of the starts of a config whose initial state has tolerances."""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from rbstab.config.numbers import replaced
from rbstab.config.schema import Config
from rbstab.config.source import Path
from rbstab.config.tolerances import Tolerance
from rbstab.experiment.convergence.enclosed_system import start_set
from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box
from rbstab.proof.exact.expr import Expr, variable
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


def whole(count: int) -> Box:
    """Return the box of all z of a number of tolerances."""
    return Box(-np.ones(count), np.ones(count))


def start_set_of(
    config: Config, tolerances: Sequence[Tolerance], part: Box, scale: Array
) -> MotionSet | None:
    """Return one set that holds all starts in a part of the tolerances.

    The number with the i-th tolerance is middle + radius z_i, with |z_i| <= 1. In the part, z_i is
    its middle plus its radius times the i-th variable of the set.

    Args:
        config: The config.
        tolerances: Tolerances of its initial state.
        part: The box of z; its ends are exact.
        scale: The size of each state, shape (n,).

    Returns:
        The set; None if the starts have no bounds.

    Raises:
        ValueError: There is no tolerance, or one is not of the initial state.
    """
    if not tolerances or any(tolerance.section != "initial" for tolerance in tolerances):
        raise ValueError("a set of starts needs tolerances of the initial state, and no others")
    ends = zip(part.lo.tolist(), part.hi.tolist(), strict=True)
    numbers = dict[Path, Expr]()
    for k, (tolerance, (low, high)) in enumerate(zip(tolerances, ends, strict=True)):
        middle, radius = (Fraction(high) + Fraction(low)) / 2, (Fraction(high) - Fraction(low)) / 2
        number = tolerance.middle + (variable(k) * radius + middle) * tolerance.radius
        numbers |= dict.fromkeys(tolerance.entry.paths, number)
    return start_set(replaced(config, numbers), monomials_of(len(tolerances)), scale)
