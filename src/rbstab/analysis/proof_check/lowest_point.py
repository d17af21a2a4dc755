"""Where a convex function of ζ is least, in balls: by signs of its slopes on the faces of a box.

Let g be its slopes at ζ = 0, H its Hessian, ζ = Bξ and M = B'HB. On the face ξ_k = x_k of a box
|ξ| <= x its slope along ξ_k is at least M_kk x_k - Σ_{j≠k} |M_kj| x_j - |B'g|_k; on the opposite
face, it is at most the negative of this. If this is positive for each k, the slopes are zero at a
point of the box (Miranda's theorem). There, by Gershgorin's theorem for the matrix of the
M_kj x_j/x_k, no eigenvalue of M is below min (M_kk - Σ |M_kj| x_j/x_k).
"""

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any

from flint import arb

from rbstab.analysis.proof_check.trigonometric import Ball, square

LEAST = 0.1
"""The least bound on the eigenvalues that is used."""

LEAST_SHARE = 0.01
"""No bound that is tried is below this share of the largest one."""

SHARPER = 3
"""The number of times that a bound on ζ is made sharper."""


def lowest_point(
    loads: Sequence[Ball], room: int, bend: Callable[[Sequence[Ball]], Any]
) -> tuple[list[Ball], Ball] | None:
    """Return bounds on the |ξ_k| of the lowest point and on the eigenvalues of M; None without any.

    Args:
        loads: Bounds on the entries of B'g.
        room: The box has so many times their size.
        bend: Returns M from bounds on the |ξ_k|.
    """
    # A load of nearly nothing needs some room too, for what the others add to it.
    least = LEAST_SHARE * reduce(arb.max, loads) + arb("1e-40")
    sizes, places = [room * one.max(least) for one in loads], range(len(loads))
    M = bend(sizes)

    def across(sizes: Sequence[Ball], k: int) -> Ball:
        return sum((M[k][j].abs_upper() * sizes[j] for j in places if j != k), arb(0))

    bounds = [arb(M[k][k].lower()) - across(sizes, k) / sizes[k] for k in places]
    if not all(load < one * size for load, one, size in zip(loads, bounds, sizes, strict=True)):
        return None
    if not all(one > LEAST for one in bounds):
        return None
    for _ in range(SHARPER):
        sizes = [((loads[k] + across(sizes, k)) / M[k][k].lower()).abs_upper() for k in places]
    return sizes, reduce(arb.min, bounds).lower()


def norm(entries: Sequence[Ball]) -> Ball:
    """Bound the norm of a vector."""
    return sum((square(one.abs_upper()) for one in entries), arb(0)).abs_upper().sqrt()
