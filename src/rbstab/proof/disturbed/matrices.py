"""Symmetric matrices that depend on Θ: whether they are positive definite on boxes of Θ.

Over a box with the centre m, M(m + δ) = M(m) + Σ δ_k ∂M/∂θ_k + what is left of second order, which
Taylor coefficients over the box bound. The affine part is positive definite on all of the box if it
is at its eight corners.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Boxes
from rbstab.proof.disturbed.forms import Rows
from rbstab.proof.enclosures.bounds import ROUND_OFF, UP, inverses
from rbstab.proof.enclosures.compiled import Compiled, exponents
from rbstab.proof.enclosures.intervals import TINY, Intervals
from rbstab.proof.enclosures.taylor import Values, unit_slopes

ANGLES = (0, 1, 2)

UNIT = 2.0**-53

CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
"""Those of a box, in its radii."""


@dataclass(frozen=True, eq=False)
class Family:
    """Symmetric matrices over boxes: middle + Σ u_k slope_k, |u_k| <= 1, and errors of entries.

    Args:
        middle: Shape (n, n, boxes).
        slopes: Shape (3, n, n, boxes).
        error: The largest errors, shape (n, n, boxes).
    """

    middle: Array
    slopes: Array
    error: Array

    def part(self, boxes: Array | slice = slice(None), rows: slice = slice(None)) -> "Family":
        """Return the matrices of some boxes, or some of their rows and columns."""
        middle, slopes, error = self.middle, self.slopes, self.error
        return Family(
            middle[rows, rows][..., boxes],
            slopes[:, rows, rows][..., boxes],
            error[rows, rows][..., boxes],
        )

    @property
    def negative(self) -> "Family":
        """The negative matrices."""
        return Family(-self.middle, -self.slopes, self.error)

    def definite(self) -> Array:
        """Return which families are proved positive definite, shape (boxes,)."""
        lost, proved = self._lost, np.ones(self.error.shape[2], dtype=bool)
        for corner in CORNERS:
            left = np.flatnonzero(proved)
            at = np.tensordot(corner, self.slopes[..., left], 1)
            proved[left] = definite(self.middle[..., left] + at, lost[:, left])
        return proved

    @property
    def _lost(self) -> Array:
        """What errors R take at most from the diagonal, shape (n, boxes): Σ_j R_ij √(s_i/s_j)."""
        # For any s > 0, R_ij |x_i x_j| <= ½ R_ij (√(s_i/s_j) x_i² + √(s_j/s_i) x_j²).
        # With s_i = 1/(M⁻¹)_ii, little is taken from what is small.
        with np.errstate(all="ignore"):
            root = np.sqrt(np.einsum("iim->im", inverses(self.middle)))
            ratio = root / root[:, None]
            lost = (self.error * np.where(ratio > 0, ratio, np.inf)).sum(axis=1)
        return np.where(np.isfinite(lost), lost, np.inf)


def definite(M: Array, lost: Array) -> Array:
    """Return which symmetric matrices less diagonal ones are proved positive definite.

    M is divided by d_i d_j, d_i = √M_ii. If Cholesky's method, in doubles, then ends on a matrix
    whose diagonal is at most 1, a matrix within n(n + 2)u of it, u = 2⁻⁵³, is not negative.

    Args:
        M: Shape (n, n, matrices).
        lost: The diagonal matrices, shape (n, matrices).

    Source: N. Higham, Accuracy and Stability of Numerical Algorithms (2002), theorem 10.3.
    """
    n = len(M)
    with np.errstate(all="ignore"):
        d = np.sqrt(np.einsum("iim->im", M))
        proved = np.all(np.isfinite(d) & (d > 0), axis=0)
        scale = np.where(proved, d, 1.0)
        L = M / scale[:, None] / scale
        rounding = 4 * UNIT * (np.abs(L).sum(axis=1) + n * (n + 2)) + TINY
        L[range(n), range(n)] -= lost / scale / scale * UP + rounding
        for k in range(n):
            proved &= L[k, k] > 0
            L[k + 1 :, k] /= np.sqrt(np.where(proved, L[k, k], 1.0))
            for j in range(k + 1, n):
                L[j:, j] -= L[j:, k] * L[j, k]
    return proved


class Matrices:
    """Symmetric matrices of expressions of Θ, which are bounded over boxes together."""

    def __init__(self, matrices: Sequence[Rows]) -> None:
        self._sizes = [len(M) for M in matrices]
        entries = [M[i][j] for M in matrices for i in range(len(M)) for j in range(i + 1)]
        leaves = {k: (k,) for k in ANGLES}
        self._count = len(entries)
        self._points = Compiled(entries, 3, leaves, 1)
        self._boxes = Compiled(entries, 3, leaves, 2)
        self._values = Compiled(entries, 0, {}, 0)
        self._seconds = [(k, row) for k, row in enumerate(exponents(3, 2)[0]) if sum(row) == 2]

    def at(self, points: Array) -> list[Array]:
        """Return the matrices at points, shape (3, points), to round-off: (n, n, points) each."""
        values = Values(self._values, dict(zip(ANGLES, points[:, None, None], strict=True)))
        entries = np.array([values.coefficients(k)[0, 0] for k in range(self._count)])
        return [self._symmetric(entries, k) for k in range(len(self._sizes))]

    @np.errstate(all="ignore")  # what has no bound is not definite
    def over(self, boxes: Boxes) -> list[Family]:
        """Return the matrices over boxes."""
        lo, hi = boxes
        centre = 0.5 * lo + 0.5 * hi
        radius = np.nextafter(np.maximum(hi - centre, centre - lo), np.inf)
        at = Values(self._points, unit_slopes(ANGLES, np.stack([centre, centre], 1)))
        over = Values(self._boxes, unit_slopes(ANGLES, np.stack([lo, hi], 1)))
        parts = [self._entry(at, over, k, radius) for k in range(self._count)]
        middle, slopes, error = (np.stack(part, -2) for part in zip(*parts, strict=True))
        return [
            Family(
                self._symmetric(middle, k), self._symmetric(slopes, k), self._symmetric(error, k)
            )
            for k in range(len(self._sizes))
        ]

    def _entry(self, at: Values, over: Values, k: int, radius: Array) -> tuple[Array, Array, Array]:
        """Return the middle, the slopes times the radii, and the error of an entry over boxes."""
        centre, second = Intervals.of(at.coefficients(k)), over.coefficients(k)
        low, high = np.zeros_like(radius[0]), np.zeros_like(radius[0])
        for place, powers in self._seconds:
            reach = np.prod([radius[i] ** p for i, p in enumerate(powers)], axis=0)
            if max(powers) == 2:  # a square is not negative
                low += np.minimum(second[place, 0], 0.0) * reach
                high += np.maximum(second[place, 1], 0.0) * reach
            else:
                size = np.abs(second[place]).max(axis=0) * reach
                low, high = low - size, high + size
        slopes = centre.mid[1:] * radius
        middle = centre.mid[0] + 0.5 * (low + high)
        error = centre.rad[0] + (centre.rad[1:] * radius).sum(axis=0) + 0.5 * (high - low)
        size = np.abs(centre.mid[0]) + np.abs(slopes).sum(axis=0) + np.abs(low) + np.abs(high)
        return middle, slopes, error * UP + ROUND_OFF * size

    def _symmetric(self, entries: Array, k: int) -> Array:
        """Return the k-th matrices from entries of shape (..., entries, boxes)."""
        begin = sum(n * (n + 1) // 2 for n in self._sizes[:k])
        i, j = np.tril_indices(self._sizes[k])
        places = np.zeros((self._sizes[k],) * 2, dtype=int)
        places[i, j] = places[j, i] = begin + np.arange(len(i))
        return np.asarray(entries[..., places, :])
