"""Newton's method and Krawczyk's test for ∇W = 0 in some variables, over many boxes at once.

With the centre m and the radius r of a box, δ = y - m, and any matrix Y near the inverse of the
Hessian, each zero y of ∇W in the box has

    y = m - Y∇W(m) + (I - YH)δ    with some H in the enclosure of the Hessian over the box.
"""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.lines.intervals import ROUNDING, Intervals
from rbstab.mechanics.numbers import Array

SUMS = 8 * ROUNDING
"""More than the relative rounding error of a sum of up to six products."""


@dataclass(frozen=True, eq=False)
class Image:
    """Where the zeros of ∇W in boxes must be.

    step bounds Y∇W(m), shape (m, n). residual bounds |I - YH| over the box, shape (m, n, n).
    """

    boxes: Boxes
    step: Intervals
    residual: Array

    @property
    def reach(self) -> Array:
        """Bounds on |(I - YH)δ|, shape (m, n)."""
        found: Array = np.einsum("mij,mj->mi", self.residual, self.boxes.radius) * (1 + SUMS)
        return found

    @property
    def box(self) -> Boxes:
        """The boxes that contain these zeros; low is above high where there is none."""
        boxes, reach = self.boxes, self.reach
        centre = boxes.centre
        # Each sum is rounded twice, relative to its larger terms.
        error = ROUNDING * (np.abs(centre) + np.abs(self.step.middle) + reach)
        low = centre - self.step.high - reach - error
        high = centre - self.step.low + reach + error
        low = np.where(np.isnan(low), -np.inf, low)
        high = np.where(np.isnan(high), np.inf, high)
        return Boxes(np.maximum(low, boxes.low), np.minimum(high, boxes.high))

    @property
    def at_most_one_zero(self) -> Array:
        """Whether I - YH has a norm below 1 over the box, in the norm of its radii, shape (m,)."""
        radius = self.boxes.radius
        return np.all(self.reach < (1 - SUMS) * radius, axis=1)

    @property
    def at_least_one_zero(self) -> Array:
        """Whether Krawczyk's map takes the box into its interior, shape (m,)."""
        size = (self.step.size + self.reach) * (1 + SUMS)
        return np.all(size < self.boxes.inner_radius * (1 - SUMS), axis=1)


def image(boxes: Boxes, gradient: Intervals, centre: Array, hessian: Intervals) -> Image:
    """Return the image of Krawczyk's map.

    Args:
        boxes: The boxes of n variables, at most six: y = [Θ, z], or z.
        gradient: ∇W at the centres, shape (m, n).
        centre: The Hessian at the centres, approximately, shape (m, n, n).
        hessian: The Hessian over the boxes.
    """
    Y = inverses(centre)
    size = np.abs(Y)
    step = (Intervals(Y, np.zeros_like(Y)) * gradient[:, np.newaxis, :]).sum(2)
    product = Y @ hessian.middle
    rounding = SUMS * (size @ np.abs(hessian.middle))
    residual = np.abs(np.eye(product.shape[-1]) - product) + size @ hessian.radius + rounding
    return Image(boxes, step, residual * (1 + SUMS))


def inverses(matrices: Array) -> Array:
    """Return the inverses to round-off; the unit matrix where there is none."""
    unit = np.eye(matrices.shape[-1])
    usable = np.all(np.isfinite(matrices), axis=(1, 2))
    safe = np.where(usable[:, np.newaxis, np.newaxis], matrices, unit)
    try:
        found = np.linalg.inv(safe)
    except np.linalg.LinAlgError:
        found = np.array([_inverse(matrix) for matrix in safe]).reshape(safe.shape)
    finite = np.all(np.isfinite(found), axis=(1, 2))
    return np.where(finite[:, np.newaxis, np.newaxis], found, unit)


def _inverse(matrix: Array) -> Array:
    try:
        return np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return np.eye(len(matrix))
