"""The direction of a line: bounds on u = e/|e| over boxes of e.

It is enclosed entry by entry, which is sharp: e/√(e² + q²) grows with e, and |u| is never above 1,
also where a line may have no length.
"""

import numpy as np

from rbstab.analysis.proof.lines.intervals import ROUNDING, Intervals, between
from rbstab.mechanics.numbers import Array


def direction(e: Intervals) -> Intervals:
    """Return u, shape (m, 3); within [-1, 1] where e may be zero."""
    low, high, squares = e.low, e.high, e.square()
    others = squares[:, [1, 2, 0]] + squares[:, [2, 0, 1]]
    least, most = np.maximum(others.low, 0.0), others.high
    below = _sine(low, np.where(low > 0, most, least), -1.0)
    above = _sine(high, np.where(high > 0, least, most), 1.0)
    return between(np.maximum(below - 4 * ROUNDING, -1.0), np.minimum(above + 4 * ROUNDING, 1.0))


def products(u: Intervals) -> Intervals:
    """Return uu', shape (m, 3, 3)."""
    found = u[:, :, np.newaxis] * u[:, np.newaxis, :]
    axes, squares = np.arange(3), u.square()
    found.middle[:, axes, axes] = squares.middle
    found.radius[:, axes, axes] = squares.radius
    return found


def _sine(e: Array, squares: Array, zero: float) -> Array:
    """Return e/√(e² + q²) to round-off; `zero` where both may be zero."""
    length = np.sqrt(e * e + squares)
    return np.where(length > 0, e / length, zero)
