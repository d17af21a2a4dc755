"""Where a convex function of some variables ζ is least, over boxes of Θ (docs/proofs.md, lemma 14).

H is its Hessian by ζ, and g its slopes at ζ = 0. Let ζ = Bξ, M = B'HB, and on a box |ξ| <= x

    λ_k = M_kk - Σ_{j≠k} |M_kj| x_j/x_k        by bounds on M over the box.

If |B'g|_k < λ_k x_k for each k, then the slopes are zero at one ζ, in this box (Miranda's theorem),
and M >= λ = min λ_k there.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rbstab.analysis.proof.lines.intervals import Intervals, exact
from rbstab.mechanics.numbers import Array

WIDER = 1 + 1e-13
"""A factor that exceeds the rounding errors of a sum of nine products of magnitudes."""

LEAST = 0.05
"""The least λ that is used."""

LEAST_SHARE = 1e-3
"""No x_k is below this share of the largest one."""

REFINEMENTS = 4
"""The number of times that a bound on ξ is made sharper."""


class LowestPoint(NamedTuple):
    """Where the function is least, over m boxes of Θ.

    Attributes:
        proved: Whether the following is proved over each box, shape (m,).
        widths: Bounds on |ζ|, shape (m, n).
        least: λ, shape (m,).
    """

    proved: Array
    widths: Array
    least: Array

    def or_else(self, other: "LowestPoint") -> "LowestPoint":
        """Return what is proved, and where nothing is, the other."""
        choice = self.proved.reshape(-1, 1)
        return LowestPoint(
            self.proved | other.proved,
            np.where(choice, self.widths, other.widths),
            np.where(self.proved, self.least, other.least),
        )


def lowest_point(
    B: Array, loads: Array, room: float, bend: Callable[[Array], Intervals]
) -> LowestPoint:
    """Return where a function is least.

    Args:
        B: B, so that B'HB is near 1, shape (m, n, n).
        loads: Bounds on the entries of B'g over each box, shape (m, n).
        room: x is so many times these, but not far below the largest of them.
        bend: Returns M over the boxes, shape (m, n, n), from bounds on |ζ|, shape (m, n).
    """
    # A load of nearly nothing needs some room too, for what the others add to it.
    sizes = room * np.maximum(loads, LEAST_SHARE * loads.max(axis=1, keepdims=True))
    M = bend(_spread(B, sizes))
    on, off = M.low.diagonal(axis1=1, axis2=2), M.size
    off[:, range(B.shape[1]), range(B.shape[1])] = 0.0
    across = np.einsum("mkj,mj->mk", off, sizes) * WIDER
    least = on - across / sizes * WIDER - (WIDER - 1) * np.abs(on)
    proved = np.all((loads * WIDER < least * sizes) & (least > LEAST), axis=1)
    for _ in range(REFINEMENTS):
        further = (loads + np.einsum("mkj,mj->mk", off, sizes)) / on * WIDER**2
        sizes = np.fmin(sizes, further)
    return LowestPoint(proved, _spread(B, sizes), least.min(axis=1))


def _spread(B: Array, sizes: Array) -> Array:
    """Bound |ζ_k| for all ζ = Bξ with |ξ_i| at most a size each, shape (m, n)."""
    found: Array = np.einsum("mki,mi->mk", np.abs(B), sizes) * WIDER
    return found


def load(B: Array, slopes: Intervals, mixed: Intervals, radius: Array) -> Array:
    """Bound the entries of B'g over boxes, shape (m, n): g = g(m) + W_iζ δ_i at ζ = 0.

    Args:
        B: B, shape (m, n, n).
        slopes: g at the centres, shape (m, n).
        mixed: W_iζ over the boxes at ζ = 0, shape (m, n, 3): the second index is that of the angle.
        radius: The radii of the boxes, shape (m, 3).
    """
    at_centre = product(turned(B), slopes[:, :, np.newaxis])[:, :, 0].size
    spread = np.einsum("mki,mi->mk", product(turned(B), mixed).size, radius)
    found: Array = (at_centre + spread) * WIDER**2
    return found


def lost(B: Array, mixed: Intervals, least: Array) -> Array:
    """Bound |W_iζ H⁻¹ W_ζj|, the part that the minimum takes off a Hessian, shape (m, 3, 3)."""
    # |B'W_iζ|/√λ
    sizes = np.sqrt((product(turned(B), mixed).size ** 2).sum(axis=1) / least[:, np.newaxis])
    found: Array = sizes[:, :, np.newaxis] * sizes[:, np.newaxis, :] * WIDER**3
    return found


def scaling(matrices: Array) -> Array:
    """Return B with B'AB near 1, for positive definite A, shape (m, n, n)."""
    values, vectors = np.linalg.eigh(matrices)
    found: Array = vectors / np.sqrt(np.maximum(values, 1e-300))[:, np.newaxis, :]
    return found


def norm(entries: Array) -> Array:
    """Bound the norms of vectors from bounds on their entries, shape (m, n); return shape (m,)."""
    found: Array = np.sqrt((entries**2).sum(axis=1)) * WIDER
    return found


def size_of(B: Array, sizes: Array) -> Array:
    """Bound |B'g| from bounds on the entries of g, shape (m, n); return shape (m,)."""
    entries = np.einsum("mki,mk->mi", np.abs(B), sizes)
    found: Array = np.sqrt((entries**2).sum(axis=1)) * WIDER**2
    return found


def widths_of(B: Array, radius: Array) -> Array:
    """Bound |ζ_k| for all ζ = Bξ with |ξ| at most a radius, shape (m, n)."""
    found: Array = np.sqrt((B**2).sum(axis=2)) * radius[:, np.newaxis] * WIDER**2
    return found


def turned(matrices: Array) -> Intervals:
    """Return the transposes of matrices."""
    return exact(matrices.swapaxes(1, 2))


def product(A: Intervals, B: Intervals) -> Intervals:
    """Return the products of matrices, the first of at most six columns."""
    return (A[..., :, :, np.newaxis] * B[..., np.newaxis, :, :]).sum(-2)
