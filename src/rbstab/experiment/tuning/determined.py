"""What a fit determines: standard errors of numbers, and combinations that stay unknown."""

import math

import numpy as np

from rbstab.mechanics.numbers import Array

RANK = 1e-10
"""Singular values below this part of the largest are zero: the derivatives are exact to 1e-12."""

IN_NULL_SPACE = 1e-6
"""A number is in an undetermined combination if its entry of the unit vector is above this."""

WIDE = 1.0
"""A combination whose 95 % interval reaches farther than this, relatively, is hardly determined."""


Loose = tuple[Array, float]
"""A combination of numbers that the data do not determine, or hardly.

First the relative change of each number, the largest 1: together they change little. Then how far
the 95 % interval reaches along it, relatively; infinite if nothing changes.
"""


def determined(
    jacobian: Array, residuals: Array, quantile: float
) -> tuple[Array, list[Loose], float]:
    """Return what is known of numbers from the singular value decomposition J = U S V'.

    The covariance is (J'J)⁻¹ = V S⁻² V', in the directions with S > 0.

    Args:
        jacobian: The derivatives of the residuals by the numbers, each in parts of its size, shape
            (n, p) with n >= p.
        residuals: In standard deviations of the measurement, shape (n,).
        quantile: Half the width of the 95 % interval, in standard errors.

    Returns:
        The standard errors, shape (p,), infinite where a number is not determined; the combinations
        that are not or hardly determined; and the length of the Gauss-Newton step that remains, in
        standard errors.
    """
    U, s, Vt = np.linalg.svd(jacobian, full_matrices=False)
    kept = s > RANK * s[0]
    variances = ((Vt[kept] / s[kept, None]) ** 2).sum(axis=0)
    unknown = (np.abs(Vt[~kept]) > IN_NULL_SPACE).any(axis=0)
    loose = []
    for size, row, known in zip(s, Vt, kept, strict=True):
        reach = quantile / size if known else math.inf
        if reach > WIDE:
            loose.append((row / row[np.abs(row).argmax()], reach * np.abs(row).max()))
    decrement = float(np.linalg.norm(U[:, kept].T @ residuals))
    return np.where(unknown, math.inf, np.sqrt(variances)), loose, decrement
