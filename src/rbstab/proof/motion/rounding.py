"""Sums and products of matrices of doubles, with proved bounds on their rounding errors.

One operation on doubles has a relative error of at most u = 2⁻⁵³. A sum of n products, added in any
order, has an error of at most n u / (1 - n u) times the sum of the absolute products (N. Higham,
"Accuracy and Stability of Numerical Algorithms", 2002, section 3.1). All sums here have fewer than
`MAX_TERMS` terms.
"""

from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array

MAX_TERMS = 100_000
"""The largest number of operations that one result of this module is made of."""

RELATIVE_ERROR = 2.0 * MAX_TERMS * 2.0**-53
"""An upper bound on n u / (1 - n u) for n <= `MAX_TERMS`."""

LARGEST = 1e15
"""The largest entry of a matrix for which `UNDERFLOW` holds."""

UNDERFLOW = 1e-250
"""More than underflow can take away from a result. A product that underflows loses at most 5e-324;
what is lost is multiplied by at most three further entries, and added up `MAX_TERMS` times."""


UNIT = 2.0**-53 * 1.001
"""A sum of n products of doubles has a rounding error of at most n times this, relative to the sum
of the absolute products, for n below 10⁹."""


def rounded_up(magnitude: Any) -> Any:
    """Return an upper bound on the exact value of a sum of products of non-negative numbers.

    Args:
        magnitude: The computed value, of any shape.
    """
    return magnitude * (1.0 + RELATIVE_ERROR) + UNDERFLOW


def error_of_products(magnitude: Any) -> Any:
    """Return a bound on the rounding error of a sum of products.

    Args:
        magnitude: The same sum, computed from the absolute values of its factors.
    """
    return RELATIVE_ERROR * rounded_up(magnitude) + UNDERFLOW


def error_of_inverse(matrix: Array, inverse: Array) -> Array:
    """Return a bound on |M⁻¹ - X| for a computed inverse X of a matrix M of doubles.

    With E = I - XM and its row sum norm η < 1, M⁻¹ = (I - E)⁻¹X and |M⁻¹ - X| <= η/(1 - η) 1 1'|X|.

    Args:
        matrix: M, shape (..., n, n).
        inverse: X, in the same shape.

    Returns:
        The bound, shape (..., n, n); infinite if it is not proved that M has an inverse.
    """
    identity = np.eye(matrix.shape[-1])
    magnitude = np.abs(inverse) @ np.abs(matrix) + identity
    defect = np.abs(identity - inverse @ matrix) + error_of_products(magnitude)
    norm = rounded_up(defect.sum(axis=-1).max(axis=-1))
    proved = norm < 0.5  # a NaN fails as well
    columns = rounded_up(np.abs(inverse).sum(axis=-2))
    ratio = np.where(proved, norm / (1.0 - norm), np.inf)[..., np.newaxis, np.newaxis]
    bound = rounded_up(ratio * columns[..., np.newaxis, :] * np.ones_like(matrix))
    return np.where(proved[..., np.newaxis, np.newaxis], bound, np.inf)
