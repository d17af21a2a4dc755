"""Rigorous bounds on the derivatives of a reduced energy over boxes, by Taylor's theorem.

Over a box that reaches r from its centre m, with δ = Θ - m,

    ∇U(Θ) = ∇U(m) + H(m)δ ± ½ Σ T_kij r_i r_j        H(Θ) = H(m) ± Σ T_kij r_i

where T bounds the third derivatives over the box: their values at m, and bounds on the fourth
derivatives, which hold anywhere. Every bound is widened by what rounding can do, in the evaluation
at m (`Derivatives.error`) and in the sums here (`SLACK`).
"""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

SLACK = 1 + 1e-12
"""More than what rounding takes from a sum of some dozen magnitudes."""


@dataclass(frozen=True, eq=False)
class Enclosure:
    """What is proved of U over each of m boxes.

    reach: r, shape (m, 3). value, gradient, hessian: at the centres, of shapes (m,), (m, 3) and
    (m, 3, 3), each with its error, of one point's shape. third: T, shape (m, 3, 3, 3).
    """

    reach: Array
    value: Array
    value_error: Array
    gradient: Array
    gradient_error: Array
    hessian: Array
    hessian_error: Array
    third: Array

    def __getitem__(self, chosen: Array) -> "Enclosure":
        return Enclosure(
            self.reach[chosen],
            self.value[chosen],
            self.value_error,
            self.gradient[chosen],
            self.gradient_error,
            self.hessian[chosen],
            self.hessian_error,
            self.third[chosen],
        )

    @property
    def hessian_reach(self) -> Array:
        """How far H can be from its value at the centre: Σ T_kij r_i, shape (m, 3, 3)."""
        change = np.einsum("mkij,mi->mkj", self.third, self.reach)
        return (change + self.hessian_error) * SLACK

    @property
    def curvature(self) -> Array:
        """How far ∇U can be from its linear part over the box, shape (m, 3)."""
        change = 0.5 * np.einsum("mkij,mi,mj->mk", self.third, self.reach, self.reach)
        linear = np.einsum("kj,mj->mk", self.hessian_error, self.reach)
        return (change + linear + self.gradient_error) * SLACK

    @property
    def monotonic(self) -> Array:
        """Whether a component of the gradient has no zero in the box, shape (m,)."""
        spread = np.einsum("mkj,mj->mk", np.abs(self.hessian), self.reach) + self.curvature
        return np.any(np.abs(self.gradient) > spread * SLACK, axis=1)

    def preconditioned(self, inverse: Array) -> "Preconditioned":
        """The same for Y∇U, with Y near H(m)⁻¹: any finite Y leaves the bounds true."""
        Y, size = inverse, np.abs(inverse)
        step = np.einsum("mkl,ml->mk", Y, self.gradient)
        product = np.einsum("mkl,mlj->mkj", Y, self.hessian)
        # What rounding does to these two products of three terms each.
        step_error = 1e-15 * np.einsum("mkl,ml->mk", size, np.abs(self.gradient))
        product_error = 1e-15 * np.einsum("mkl,mlj->mkj", size, np.abs(self.hessian))
        skew = np.abs(np.eye(3) - product) + product_error
        return Preconditioned(
            self.reach,
            step,
            step_error + np.einsum("mkl,ml->mk", size, self.curvature) * SLACK,
            np.abs(step) + step_error + np.einsum("mkl,l->mk", size, self.gradient_error),
            skew,
            (skew + np.einsum("mkl,mlj->mkj", size, self.hessian_reach)) * SLACK,
        )


@dataclass(frozen=True, eq=False)
class Preconditioned:
    """What is proved of Y∇U over each of m boxes: Y∇U(Θ) = step + δ ± (skew r + curvature).

    step_size bounds |Y∇U(m)|; slope_skew bounds |I - YH| over the whole box.
    """

    reach: Array
    step: Array
    curvature: Array
    step_size: Array
    skew: Array
    slope_skew: Array

    @property
    def remainder(self) -> Array:
        """How far Y∇U can be from step + δ, shape (m, 3)."""
        return np.einsum("mkj,mj->mk", self.skew, self.reach) + self.curvature

    @property
    def without_zero(self) -> Array:
        """Whether the gradient has no zero in the box, shape (m,)."""
        allowed = (self.reach + self.remainder) * SLACK
        return np.any(np.abs(self.step) > allowed, axis=1)

    @property
    def one_at_most(self) -> Array:
        """Whether I - YH has a norm below one, so that Y∇U takes no value twice, shape (m,)."""
        return np.all(self.slope_skew.sum(axis=2) * SLACK < 1, axis=1)

    @property
    def one_at_least(self) -> Array:
        """Krawczyk's test: |Y∇U(m)| + |I - YH| r < r maps the box into its inside, shape (m,)."""
        image = self.step_size + np.einsum("mkj,mj->mk", self.slope_skew, self.reach)
        return np.all(image * SLACK < self.reach, axis=1)


def enclosure(form: TrigonometricForm, boxes: Boxes) -> Enclosure:
    """The bounds over boxes, about their centres."""
    reach = boxes.reach
    value, gradient, hessian, third = form.rigorous(boxes.centre, 3)
    drift = np.einsum("kijl,ml->mkij", form.fourth_derivative_bound, reach)
    return Enclosure(
        reach,
        value.values,
        value.error,
        gradient.values,
        gradient.error,
        hessian.values,
        hessian.error,
        (np.abs(third.values) + third.error + drift) * SLACK,
    )


def inverses(matrices: Array) -> Array:
    """3x3 inverses by cofactors, shape (m, 3, 3); of a singular matrix not finite."""
    with np.errstate(all="ignore"):
        # Products of three entries would leave the range of doubles where the entries are near it.
        size = np.abs(matrices).max(axis=(1, 2), keepdims=True)
        scaled = matrices / size
        a, b, c = scaled[:, :, 0], scaled[:, :, 1], scaled[:, :, 2]
        rows = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
        determinant = np.einsum("mi,mi->m", a, rows[:, 0])[:, np.newaxis, np.newaxis]
        return rows / determinant / size
