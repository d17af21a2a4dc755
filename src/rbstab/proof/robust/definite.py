"""The bodies in a box whose mass, inertia and damping are the lowest, exactly."""

from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import product

from rbstab.systems.system import System


def lowest_systems(
    corner: Callable[[tuple[int, int, int]], System],
) -> Iterator[System]:
    """Yield the systems of the bodies that decide what is definite for all bodies in a box.

    x'Mx is linear in each entry of a symmetric matrix M, and grows with its diagonal. So M, or a
    sum of such matrices, is positive (semi)definite for all bodies if it is so with the lowest
    diagonal and each of the eight choices of low or high off-diagonal entries.

    Args:
        corner: Returns the system in rational numbers. Its argument has the signs of the entries
            (1, 2), (1, 3) and (2, 3) of all matrices: -1 for the lowest, 1 for the highest. All
            other numbers are the lowest.
    """
    for first, second, third in product((-1, 1), repeat=3):
        yield corner((first, second, third))


def bound_at(
    path: tuple[str | int, ...], low: Fraction, high: Fraction, signs: tuple[int, int, int]
) -> Fraction:
    """Return the bound of a number at a corner of `lowest_systems`.

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
