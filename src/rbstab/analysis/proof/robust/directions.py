"""Sharper tests for the search of a family of energies: directions in which all of them rise.

At a point, the gradients of all members are g_0 + Σ w_j g_j with |w_j| <= 1. None of them is zero
if |y'g_0| > Σ |y'g_j| for some vector y. Tests of single components of the gradient use y along an
axis only, and so forget that a member has the same weight w_j in all components.
"""

from dataclasses import dataclass, field

import numpy as np

from rbstab.analysis.proof.box_bounds import Enclosure, inverses
from rbstab.analysis.proof.boxes import ROUNDING_FACTOR, Boxes
from rbstab.analysis.proof.robust.convexity import isolated_minimum
from rbstab.analysis.proof.robust.family import FormFamily
from rbstab.analysis.proof.zero import Zero, isolated_zero
from rbstab.mechanics.numbers import Array

MAX_DOUBTFUL = 64
"""The largest number of doubtful points that are kept."""


@dataclass(eq=False)
class FamilyTests:
    """The further tests (`branch_and_bound.Tests`) of a family.

    doubtful are points at which no test can show that the gradients are not zero, shape (n, 3).
    """

    family: FormFamily
    doubtful: Array = field(default_factory=lambda: np.zeros((0, 3)))
    centre: Array | None = None

    def isolated(self, Theta: Array) -> Zero | None:
        """Prove that each member has one rest state near a point, by convexity or by Krawczyk."""
        zero = isolated_minimum(self.family, Theta) or isolated_zero(self.family, Theta)
        if zero is not None and self.centre is None:
            self.centre = Theta
        return zero

    def excludes_zero(self, boxes: Boxes, enclosed: Enclosure) -> Array:
        """Return whether the gradients of all members are proved not to be zero in each box."""
        found = np.zeros(len(boxes), dtype=bool)
        if not len(boxes):
            return found
        gradients, error = self.family.gradients(boxes.centre)
        slope_of_middle = np.abs(enclosed.hessian)
        for y in self._directions(boxes.centre, gradients[:, 0], enclosed.hessian):
            size = np.abs(y)
            # y'∇U = y'g_0 + Σ w_j y'g_j + y'H_0 δ + the parts that `curvature` bounds.
            rise = np.abs(np.einsum("mi,mi->m", y, gradients[:, 0]))
            turned = np.einsum("mi,mij->mj", y, enclosed.hessian)
            moved = np.einsum("mj,mj->m", np.abs(turned), enclosed.radius)
            found |= rise > self._allowed(y, gradients, error) + (
                moved + np.einsum("mi,mi->m", size, _beyond_linear(enclosed))
            ) * ROUNDING_FACTOR + 1e-15 * np.einsum(
                "mi,mij,mj->m", size, slope_of_middle, enclosed.radius
            )
        return found

    def hopeless(self, boxes: Boxes, zeros: list[Zero]) -> bool:
        """Return whether no test can succeed at the centre of some box, or a second zero is known.

        Each smaller box that contains such a point has about the same bounds there.
        """
        centres = boxes.centre
        for zero in zeros:
            inside = np.all((centres >= zero.domain.low) & (centres <= zero.domain.high), axis=1)
            centres = centres[~inside]
        if len(centres):
            centres = centres[self._flat(centres)]
        self.doubtful = centres[:MAX_DOUBTFUL]
        return len(zeros) > 1 or len(centres) > 0

    def _flat(self, points: Array) -> Array:
        """Return whether the gradient of some member may be zero at each point, shape (m,)."""
        gradients, error = self.family.gradients(points)
        hessian = self.family.approximate(points, 2)[2]
        flat = np.ones(len(points), dtype=bool)
        axes = [np.broadcast_to(axis, points.shape) for axis in np.eye(3)]
        for y in [*axes, *self._directions(points, gradients[:, 0], hessian)]:
            rise = np.abs(np.einsum("mi,mi->m", y, gradients[:, 0]))
            flat &= ~(rise > self._allowed(y, gradients, error))
        return flat

    def _allowed(self, y: Array, gradients: Array, error: Array) -> Array:
        """Bound Σ |y'g_j| and all rounding errors, shape (m,)."""
        size = np.abs(y)
        spread = np.abs(np.einsum("mfi,mi->mf", gradients[:, 1:], y)).sum(axis=1)
        # The products with y are sums of three products, with at most four roundings each.
        rounding = size @ error + 1e-15 * np.einsum("mfi,mi->m", np.abs(gradients), size)
        allowed: Array = (spread + rounding) * ROUNDING_FACTOR
        return allowed

    def _directions(self, points: Array, gradient: Array, hessian: Array) -> list[Array]:
        """Return vectors y that are worth trying, each of shape (m, 3)."""
        found = [gradient, np.einsum("mij,mj->mi", inverses(hessian), gradient)]
        if self.centre is not None:
            found.append(points - self.centre)
        largest = [np.abs(y).max(axis=1, keepdims=True) for y in found]
        return [
            np.where(np.isfinite(y) & (size > 0), y / size, 0.0)
            for y, size in zip(found, largest, strict=True)
        ]


def _beyond_linear(enclosed: Enclosure) -> Array:
    """Bound the deviation of ∇U from its part g + H_0 δ with g at the centre, shape (m, 3)."""
    change = 0.5 * np.einsum("mkij,mi,mj->mk", enclosed.third, enclosed.radius, enclosed.radius)
    change = change + np.einsum("mkj,mj->mk", enclosed.hessian_error, enclosed.radius)
    return change * ROUNDING_FACTOR
