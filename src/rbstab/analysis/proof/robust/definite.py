"""Mass, inertia, stiffness and damping of all bodies in a box are positive definite, exactly."""

from collections.abc import Callable
from fractions import Fraction
from itertools import product

from rbstab.analysis.exact import is_positive_definite
from rbstab.analysis.proof.definite import indefinite_parameter
from rbstab.systems.system import System


def indefinite_in_box(
    corner: Callable[[tuple[int, int, int]], System],
) -> str | None:
    """Return the name of a parameter that is not positive definite for some body; None if all are.

    x'Mx is linear in each entry of a symmetric matrix M, and grows with its diagonal. So M is
    positive definite for all bodies if it is so with the lowest diagonal and each of the eight
    choices of low or high off-diagonal entries.

    Args:
        corner: Returns the system in rational numbers. Its argument has the signs of the entries
            (1, 2), (1, 3) and (2, 3) of all matrices: -1 for the lowest, 1 for the highest. All
            other numbers are the lowest.
    """
    for signs in product((-1, 1), repeat=3):
        first, second, third = signs
        system = corner((first, second, third))
        name = indefinite_parameter(system)
        if name is not None:
            return name
        for element in system.elements:
            for gain in element.gains:
                matrix = gain.positive and gain.shape == "matrix"
                if matrix and not is_positive_definite(getattr(element, gain.name)):
                    return gain.name
    return None


def bound_at(
    path: tuple[str | int, ...], low: Fraction, high: Fraction, signs: tuple[int, int, int]
) -> Fraction:
    """Return the bound of a number at a corner of `indefinite_in_box`.

    Args:
        path: The path of the number; that of an entry of a matrix ends with its row and column.
        low: Its lower bound.
        high: Its upper bound.
        signs: The signs of the entries beside the diagonals.
    """
    row, column = (path[-2], path[-1]) if len(path) > 1 else (None, None)
    if not (isinstance(row, int) and isinstance(column, int)) or row == column:
        return low
    place = {(0, 1): 0, (0, 2): 1, (1, 2): 2}[min(row, column), max(row, column)]
    return high if signs[place] > 0 else low
