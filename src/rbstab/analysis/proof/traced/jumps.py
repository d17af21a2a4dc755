"""Where the slopes of some energies max(h(Θ), 0) jump in boxes, and which zeros that excludes."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.proof.box_bounds import Enclosure
from rbstab.analysis.proof.boxes import ROUNDING_FACTOR
from rbstab.analysis.proof.formulas.functions import reciprocal
from rbstab.analysis.proof.lines.intervals import Intervals, between, exact, total
from rbstab.mechanics.numbers import Array


@dataclass(frozen=True, eq=False)
class Jumps:
    """Proved bounds on n energies max(h(Θ), 0) over m boxes in which their slopes may jump.

    Args:
        anywhere: Whether one of them may jump in each box, shape (m,).
        below: Bounds on U with λh in place of each that may jump. It is nowhere above U. None for
            -U.
        share: These λ, between 0 and 1, shape (m, n). Any will do; the best make ∇U small.
        slopes: ∇h over each box, shape (m, n, 3); 0 where it does not jump.
    """

    anywhere: Array
    below: Enclosure | None
    share: Array
    slopes: Intervals

    def __getitem__(self, chosen: Array) -> "Jumps":
        below = None if self.below is None else self.below[chosen]
        return Jumps(self.anywhere[chosen], below, self.share[chosen], self.slopes[chosen])

    @property
    @np.errstate(all="ignore")  # comparisons with NaN are false
    def excludes_zero(self) -> Array:
        """Whether it is proved for each box that no slopes are zero together, shape (m,).

        All slopes are g + Σ t_k ∇h_k with the gradient g of `below` and with λ_k + t_k between 0
        and 1. For zero slopes, n_k'(g + Σ t_j ∇h_j) = 0 with n_k near ∇h_k leaves less of t_k. None
        are zero if nothing is left of one t_k, or if d'(g + Σ t_k ∇h_k) > 0, where d is g at the
        centre.
        """
        assert self.below is not None
        count = self.share.shape[1]
        room = [between(-self.share[:, k], 1 - self.share[:, k]) for k in range(count)]
        empty = np.zeros(len(self.anywhere), dtype=bool)
        for k in range(count):
            normal = self.slopes.middle[:, k]
            along = self._along(normal)
            others = [room[j] * along[j] for j in range(count) if j != k]
            rest = total([gradient_along(self.below, normal), *others])
            needed = -rest * reciprocal(along[k])[0]
            low = np.fmax(room[k].low, needed.low)
            high = np.fmin(room[k].high, needed.high)
            empty |= low > high
            room[k] = between(low, high)
        d = self.below.gradient
        added = [one * along for one, along in zip(room, self._along(d), strict=True)]
        product = total([gradient_along(self.below, d), *added])
        found: Array = self.anywhere & (empty | (product.low > 0))
        return found

    def _along(self, direction: Array) -> list[Intervals]:
        """Return the products of a direction in each box, shape (m, 3), with each ∇h."""
        products = exact(direction[:, np.newaxis]) * self.slopes
        return [products[:, k].sum(1) for k in range(self.share.shape[1])]


def gradient_along(found: Enclosure, direction: Array) -> Intervals:
    """Return the products of a direction in each box, shape (m, 3), with ∇U over the box."""
    size = np.abs(direction)
    bent = np.abs(np.einsum("mkj,mk->mj", found.hessian, direction))
    spread = np.einsum("mj,mj->m", bent, found.radius)
    spread += np.einsum("mk,mk->m", found.curvature, size)
    terms = np.einsum("mk,mk->m", np.abs(found.gradient), size)
    terms += np.einsum("mkj,mk,mj->m", np.abs(found.hessian), size, found.radius)
    middle = np.einsum("mk,mk->m", found.gradient, direction)
    return Intervals(middle, spread * ROUNDING_FACTOR + 1e-14 * terms)
