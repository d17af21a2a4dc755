"""An order of points in which every beginning covers their whole range: coarse, then finer."""

import numpy as np

from rbstab.mechanics.numbers import Array

MAX_BITS = 60
"""The largest number of bits of a code, which must fit into 64."""


def spread_order(table: Array) -> Array:
    """Return an order of points in which every beginning is spread over all of them.

    Along each axis the ranks of the values are cut in halves, the halves in quarters, and so on.
    Points follow one another in turns of the halves, then of the quarters: the first 4 points of a
    16 x 16 grid are one in each quadrant, the first 16 are a 4 x 4 grid.

    Args:
        table: The points, one in each row, shape (n, axes).

    Returns:
        The numbers of the rows, shape (n,).
    """
    count = len(table)
    ranks = [np.unique(column, return_inverse=True) for column in table.T]
    varied = [(len(values), inverse.ravel()) for values, inverse in ranks if len(values) > 1]
    most = MAX_BITS // max(len(varied), 1)
    axes = [_halves(size, most)[inverse] for size, inverse in varied if most]
    code, place = np.zeros(count, dtype=np.int64), 0
    # The coarsest bits change first, so they are the lowest ones of the code.
    for level in range(most):
        for halves in axes:
            if level < halves.shape[1]:
                code += halves[:, level].astype(np.int64) << place
                place += 1
    # Points that share a code take turns with those of the others.
    by_code = np.argsort(code, kind="stable")
    same = code[by_code]
    begins = np.flatnonzero(np.append(True, same[1:] != same[:-1])) if count else same
    turn = np.zeros(count, dtype=np.int64)
    turn[by_code] = np.arange(count) - np.repeat(begins, np.diff(np.append(begins, count)))
    order: Array = np.lexsort((code, turn))
    return order


def _halves(values: int, most: int) -> Array:
    """Return the half of each of some ranks at each level, 0 or 1, shape (values, levels).

    There are at most `most` levels.

    The first half is the larger one. A rank that is alone is in the first half of each later level.
    """
    place = np.arange(values)
    size = np.full(values, values)
    levels = []
    for _ in range(min((values - 1).bit_length(), most)):
        first = (size + 1) // 2
        second = place >= first
        levels.append(second.astype(np.int8))
        place = np.where(second, place - first, place)
        size = np.where(second, size - first, first)
    found: Array = np.stack(levels, axis=1)
    return found


def alternated(orders: list[Array]) -> Array:
    """Return several orders as one, in which each of them advances by the same fraction.

    Args:
        orders: The orders, each with numbers of its own.
    """
    fractions = [(np.arange(len(order)) + 0.5) / max(len(order), 1) for order in orders]
    numbers = np.concatenate([np.zeros(0, dtype=int), *orders])
    taken: Array = numbers[np.argsort(np.concatenate([np.zeros(0), *fractions]), kind="stable")]
    return taken
