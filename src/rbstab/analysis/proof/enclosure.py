"""Rigorous bounds on the derivatives of a reduced energy over boxes, by Taylor's theorem.

A box has the centre m and the radius r (one per axis). With δ = Θ - m,

    ∇U(Θ) = ∇U(m) + H(m)δ ± ½ Σ T_kij r_i r_j        H(Θ) = H(m) ± Σ T_kij r_i

T bounds the third derivatives over the box: it is their absolute value at m, plus r times a global
bound on the fourth derivatives. Every bound includes the largest rounding error of the evaluation
at m (`Derivatives.error`) and of the sums here (`ROUNDING_FACTOR`).

Lines add theirs (`LinePart.over`).

A barrier on θ2 adds its derivatives. Near ±π/2 they change so fast that Taylor's theorem needs thin
boxes. There the exact bounds of its energy and slope over the box are sharper.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from rbstab.analysis.proof.boxes import ROUNDING_FACTOR, Boxes
from rbstab.analysis.proof.guard import Guard
from rbstab.analysis.proof.lines.intervals import total
from rbstab.analysis.proof.lines.over_boxes import at_centres
from rbstab.analysis.proof.trigonometric import ROUND_OFF, TrigonometricForm, along_second
from rbstab.mechanics.numbers import Array


@dataclass(frozen=True, eq=False)
class Enclosure:
    """Proved bounds on U over each of m boxes.

    radius is r, shape (m, 3). value, gradient and hessian are U and its derivatives at the centres,
    shapes (m,), (m, 3) and (m, 3, 3). Their errors bound the rounding error at any centre, shapes
    (), (3,) and (3, 3). For a family of energies they also bound the distance of its members, for
    each box: shapes (m,), (m, 3) and (m, 3, 3). third is T, shape (m, 3, 3, 3).
    """

    radius: Array
    value: Array
    value_error: Array
    gradient: Array
    gradient_error: Array
    hessian: Array
    hessian_error: Array
    third: Array

    def __getitem__(self, chosen: Array) -> "Enclosure":
        by_box = self.value_error.ndim > 0
        shared = () if by_box else ("value_error", "gradient_error", "hessian_error")
        changes = {
            field.name: getattr(self, field.name)[chosen]
            for field in fields(self)
            if field.name not in shared
        }
        return replace(self, **changes)

    def negated(self) -> "Enclosure":
        """Return the bounds on -U."""
        return replace(self, value=-self.value, gradient=-self.gradient, hessian=-self.hessian)

    @property
    def error(self) -> Array:
        """Bound on the part of U's deviation that the errors cause over the box, shape (m,)."""
        r = self.radius
        if self.gradient_error.ndim == 1:
            linear = self.gradient_error @ r.T
        else:
            linear = np.einsum("mi,mi->m", self.gradient_error, r)
        return (
            self.value_error
            + linear
            + 0.5 * np.einsum("...ij,...i,...j->...", self.hessian_error, r, r)
        )

    @property
    def hessian_radius(self) -> Array:
        """Bound on the deviation of H from its value at the centre: Σ T_kij r_i, (m, 3, 3)."""
        change = np.einsum("mkij,mi->mkj", self.third, self.radius)
        return (change + self.hessian_error) * ROUNDING_FACTOR

    @property
    def curvature(self) -> Array:
        """Bound on the deviation of ∇U from its linear part over the box, shape (m, 3)."""
        change = 0.5 * np.einsum("mkij,mi,mj->mk", self.third, self.radius, self.radius)
        linear = np.einsum("...kj,...j->...k", self.hessian_error, self.radius)
        return (change + linear + self.gradient_error) * ROUNDING_FACTOR

    @property
    def monotonic(self) -> Array:
        """Whether a component of the gradient is proved to have no zero in the box, shape (m,)."""
        spread = np.einsum("mkj,mj->mk", np.abs(self.hessian), self.radius) + self.curvature
        return np.any(np.abs(self.gradient) > spread * ROUNDING_FACTOR, axis=1)

    @property
    def gradient_bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds on each component of the gradient over the box, shape (m, 3)."""
        spread = np.einsum("mkj,mj->mk", np.abs(self.hessian), self.radius) + self.curvature
        spread = spread * ROUNDING_FACTOR + 1e-15 * np.abs(self.gradient)
        return self.gradient - spread, self.gradient + spread

    def preconditioned(self, inverse: Array) -> "PreconditionedGradient":
        """Return the bounds on Y∇U, with Y near H(m)⁻¹; the bounds hold for any finite Y."""
        Y, size = inverse, np.abs(inverse)
        step = np.einsum("mkl,ml->mk", Y, self.gradient)
        product = np.einsum("mkl,mlj->mkj", Y, self.hessian)
        # Bounds on the rounding errors of these two sums of three products.
        step_error = 1e-15 * np.einsum("mkl,ml->mk", size, np.abs(self.gradient))
        product_error = 1e-15 * np.einsum("mkl,mlj->mkj", size, np.abs(self.hessian))
        residual = np.abs(np.eye(3) - product) + product_error
        return PreconditionedGradient(
            self.radius,
            step,
            step_error + np.einsum("mkl,ml->mk", size, self.curvature) * ROUNDING_FACTOR,
            np.abs(step) + step_error + np.einsum("...kl,...l->...k", size, self.gradient_error),
            residual,
            (residual + np.einsum("mkl,mlj->mkj", size, self.hessian_radius)) * ROUNDING_FACTOR,
        )


@dataclass(frozen=True, eq=False)
class GuardedEnclosure(Enclosure):
    """Proved bounds on U with a barrier on θ2 over each of m boxes.

    bare has the bounds on U without the barrier. energy and slope bound the energy of the barrier
    and its derivative by θ2 over each box, from low to high, shape (m, 2).
    """

    bare: Enclosure
    energy: Array
    slope: Array

    def negated(self) -> "GuardedEnclosure":
        """Return the bounds on -U."""
        return replace(
            self,
            value=-self.value,
            gradient=-self.gradient,
            hessian=-self.hessian,
            bare=self.bare.negated(),
            energy=-self.energy[:, ::-1],
            slope=-self.slope[:, ::-1],
        )

    @property
    def monotonic(self) -> Array:
        """Whether a component of the gradient is proved to have no zero in the box, shape (m,)."""
        bare, radius = self.bare, self.bare.radius
        spread = np.einsum("mj,mj->m", np.abs(bare.hessian[:, 1]), radius) + bare.curvature[:, 1]
        spread *= ROUNDING_FACTOR
        low, high = self.slope.T
        size = np.abs(bare.gradient[:, 1]) + spread
        rises = bare.gradient[:, 1] - spread + low > 1e-15 * (size + np.abs(low))
        falls = bare.gradient[:, 1] + spread + high < -1e-15 * (size + np.abs(high))
        return super().monotonic | rises | falls


@dataclass(frozen=True, eq=False)
class PreconditionedGradient:
    """Proved bounds on Y∇U over each of m boxes: Y∇U(Θ) = step + δ ± (residual r + curvature).

    radius is r. residual bounds |I - YH(m)|, box_residual bounds |I - YH| over the whole box, and
    step_size bounds |Y∇U(m)|.
    """

    radius: Array
    step: Array
    curvature: Array
    step_size: Array
    residual: Array
    box_residual: Array

    @property
    def remainder(self) -> Array:
        """Bound on the deviation of Y∇U from step + δ, shape (m, 3)."""
        return np.einsum("mkj,mj->mk", self.residual, self.radius) + self.curvature

    @property
    def excludes_zero(self) -> Array:
        """Whether the gradient is proved to have no zero in the box, shape (m,)."""
        allowed = (self.radius + self.remainder) * ROUNDING_FACTOR
        return np.any(np.abs(self.step) > allowed, axis=1)

    @property
    def at_most_one_zero(self) -> Array:
        """Whether the box is proved to have at most one zero, shape (m,).

        The condition is that I - YH has a norm below one, so that Y∇U takes no value twice.
        """
        return np.all(self.box_residual.sum(axis=2) * ROUNDING_FACTOR < 1, axis=1)

    def at_least_one_zero(self, inner_radius: Array) -> Array:
        """Whether the box is proved to have at least one zero, by Krawczyk's test, shape (m,).

        If |Y∇U(m)| + |I - YH| r < r, the map Θ - Y∇U(Θ) takes the box into its interior.

        Args:
            inner_radius: `Boxes.inner_radius`. r is rounded up, so on the right-hand side it would
                describe a box that is wider than the box itself, by the last digit.
        """
        image = self.step_size + np.einsum("mkj,mj->mk", self.box_residual, self.radius)
        return np.all(image * ROUNDING_FACTOR < inner_radius, axis=1)


def enclosure(form: TrigonometricForm, boxes: Boxes) -> Enclosure:
    """Compute the bounds over boxes, about their centres."""
    if form.guard is None:
        return _bare_enclosure(form, boxes)
    return _guarded(_bare_enclosure(replace(form, guard=None), boxes), form.guard, boxes)


def _guarded(bare: Enclosure, guard: Guard, boxes: Boxes) -> GuardedEnclosure:
    """Add a barrier on θ2 to bounds over boxes."""
    low, high = guard.over(boxes.low[:, 1], boxes.high[:, 1])
    at_centre = zip(*guard.at(boxes.centre[:, 1], 2), strict=True)
    value, value_error = _plus(bare.value, bare.value_error, *next(at_centre))
    gradient, gradient_error = _plus(bare.gradient, bare.gradient_error, *next(at_centre))
    hessian, hessian_error = _plus(bare.hessian, bare.hessian_error, *next(at_centre))
    third = bare.third.copy()
    third[:, 1, 1, 1] += np.maximum(-low[3], high[3])
    return GuardedEnclosure(
        bare.radius,
        value,
        value_error,
        gradient,
        gradient_error,
        hessian,
        hessian_error,
        third * ROUNDING_FACTOR,
        bare=bare,
        energy=np.stack([low[0], high[0]], axis=1),
        slope=np.stack([low[1], high[1]], axis=1),
    )


def _plus(values: Array, error: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Add a function of θ2 that lies between bounds at each centre; return values and errors."""
    total, wider = values.copy(), np.broadcast_to(error, values.shape).copy()
    place = along_second(values)
    total[place] += low
    # The difference and the sum are rounded.
    wider[place] += (high - low) + 2 * ROUND_OFF * np.abs(total[place])
    return total, wider * ROUNDING_FACTOR + np.finfo(float).tiny


def _bare_enclosure(form: TrigonometricForm, boxes: Boxes) -> Enclosure:
    """Compute the bounds of a form without a barrier."""
    if form.lines:
        return _enclosure_with_lines(form, boxes)
    radius = boxes.radius
    value, gradient, hessian, third = form.rigorous(boxes.centre, 3)
    drift = np.einsum("kijl,ml->mkij", form.fourth_derivative_bound, radius)
    return Enclosure(
        radius,
        value.values,
        value.error,
        gradient.values,
        gradient.error,
        hessian.values,
        hessian.error,
        (np.abs(third.values) + third.error + drift) * ROUNDING_FACTOR,
    )


def _enclosure_with_lines(form: TrigonometricForm, boxes: Boxes) -> Enclosure:
    """Compute the bounds of a form with lines; terms of opposite signs are taken together."""
    radius, t = boxes.radius, form.basis(boxes.centre)
    parts = [at_centres(form, t, boxes), *(line.over(t, boxes) for line in form.lines)]
    value, gradient, hessian, third = (total(part) for part in zip(*parts, strict=True))
    return Enclosure(
        radius,
        value.middle,
        value.radius,
        gradient.middle,
        gradient.radius,
        hessian.middle,
        hessian.radius,
        third.size,
    )


def inverses(matrices: Array) -> Array:
    """Invert 3x3 matrices by cofactors, shape (m, 3, 3); not finite for a singular matrix."""
    with np.errstate(all="ignore"):
        # Scale first: products of three large entries would overflow, of small entries underflow.
        size = np.abs(matrices).max(axis=(1, 2), keepdims=True)
        scaled = matrices / size
        a, b, c = scaled[:, :, 0], scaled[:, :, 1], scaled[:, :, 2]
        rows = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
        determinant = np.einsum("mi,mi->m", a, rows[:, 0])[:, np.newaxis, np.newaxis]
        return rows / determinant / size
