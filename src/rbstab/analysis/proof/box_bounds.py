"""Rigorous bounds on the derivatives of a reduced energy over boxes, by Taylor's theorem.

A box has the centre m and the radius r (one per axis). With δ = Θ - m,

    ∇U(Θ) = ∇U(m) + H(m)δ ± ½ Σ T_kij r_i r_j        H(Θ) = H(m) ± Σ T_kij r_i

T bounds the third derivatives over the box: it is their absolute value at m, plus r times a global
bound on the fourth derivatives. Every bound includes the largest rounding error of the evaluation
at m (`Derivatives.error`) and of the sums here (`ROUNDING_FACTOR`).
"""

from dataclasses import dataclass, field, fields, replace

import numpy as np

from rbstab.analysis.proof.boxes import ROUNDING_FACTOR
from rbstab.analysis.proof.formulas.functions import reciprocal
from rbstab.analysis.proof.lines.intervals import Intervals, between, exact, total
from rbstab.mechanics.numbers import Array


@dataclass(frozen=True, eq=False)
class Enclosure:
    """Proved bounds on U over each of m boxes.

    radius is r, shape (m, 3). value, gradient and hessian are U and its derivatives at the centres,
    shapes (m,), (m, 3) and (m, 3, 3). Their errors bound the rounding error at any centre, shapes
    (), (3,) and (3, 3). For a family of energies they also bound the distance of its members, for
    each box: shapes (m,), (m, 3) and (m, 3, 3). third is T, shape (m, 3, 3, 3).

    If elements of users jump in a box, `gradient` and its error contain all their slopes over the
    box, so they hold as before, but the Hessian does not bound these slopes: `kinks`.
    """

    radius: Array
    value: Array
    value_error: Array
    gradient: Array
    gradient_error: Array
    hessian: Array
    hessian_error: Array
    third: Array
    kinks: "Jumps | None" = field(default=None, kw_only=True)

    def __getitem__(self, chosen: Array) -> "Enclosure":
        by_box = self.value_error.ndim > 0
        shared = () if by_box else ("value_error", "gradient_error", "hessian_error")
        if self.kinks is None:
            shared = (*shared, "kinks")
        changes = {
            field.name: getattr(self, field.name)[chosen]
            for field in fields(self)
            if field.name not in shared
        }
        return replace(self, **changes)

    def negated(self) -> "Enclosure":
        """Return the bounds on -U."""
        return replace(
            self,
            value=-self.value,
            gradient=-self.gradient,
            hessian=-self.hessian,
            kinks=self.negated_kinks,
        )

    @property
    def negated_kinks(self) -> "Jumps | None":
        """Where the slopes of -U may jump."""
        return None if self.kinks is None else replace(self.kinks, below=None)

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
        """Bound on the deviation of H from its value at the centre: Σ T_kij r_i, (m, 3, 3).

        There is none where a slope jumps.
        """
        change = np.einsum("mkij,mi->mkj", self.third, self.radius)
        found: Array = (change + self.hessian_error) * ROUNDING_FACTOR
        if self.kinks is not None:
            found[self.kinks.anywhere] = np.inf
        return found

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

    def along(self, direction: Array) -> Intervals:
        """Return the products of a direction in each box, shape (m, 3), with ∇U over the box."""
        size = np.abs(direction)
        bent = np.abs(np.einsum("mkj,mk->mj", self.hessian, direction))
        spread = np.einsum("mj,mj->m", bent, self.radius)
        spread += np.einsum("mk,mk->m", self.curvature, size)
        terms = np.einsum("mk,mk->m", np.abs(self.gradient), size)
        terms += np.einsum("mkj,mk,mj->m", np.abs(self.hessian), size, self.radius)
        middle = np.einsum("mk,mk->m", self.gradient, direction)
        return Intervals(middle, spread * ROUNDING_FACTOR + 1e-14 * terms)

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
class Jumps:
    """Proved bounds on n energies max(h, 0) or min(h, 0) over m boxes where their slopes may jump.

    Args:
        anywhere: Whether the slope of one of them may jump in each box, shape (m,).
        flat: Bounds on U with λh in place of each that may jump.
        below: The same, but each min(h, 0) that may jump stays, with all its slopes: it is nowhere
            above U. None for -U.
        share: These λ, between 0 and 1, shape (m, n). Any will do; the best make ∇U small.
        slopes: ∇h over each box, shape (m, n, 3); 0 where it does not jump.
    """

    anywhere: Array
    flat: Enclosure
    below: Enclosure | None
    share: Array
    slopes: Intervals

    def __getitem__(self, chosen: Array) -> "Jumps":
        below = None if self.below is None else self.below[chosen]
        return Jumps(
            self.anywhere[chosen],
            self.flat[chosen],
            below,
            self.share[chosen],
            self.slopes[chosen],
        )

    @property
    @np.errstate(all="ignore")  # comparisons with NaN are false
    def excludes_zero(self) -> Array:
        """Whether it is proved for each box that for no λ all slopes of U are zero, shape (m,).

        All slopes are g + Σ t_k ∇h_k with the gradient g of `flat` and with λ_k + t_k between 0
        and 1. For zero slopes, n_k'(g + Σ t_j ∇h_j) = 0 with n_k near ∇h_k leaves less of t_k. None
        are zero if nothing is left of one t_k, or if d'(g + Σ t_k ∇h_k) > 0, where d is g at the
        centre.
        """
        count = self.share.shape[1]
        room = [between(-self.share[:, k], 1 - self.share[:, k]) for k in range(count)]
        empty = np.zeros(len(self.anywhere), dtype=bool)
        for k in range(count):
            normal = self.slopes.middle[:, k]
            along = self._along(normal)
            others = [room[j] * along[j] for j in range(count) if j != k]
            rest = total([self.flat.along(normal), *others])
            needed = -rest * reciprocal(along[k])[0]
            low = np.fmax(room[k].low, needed.low)
            high = np.fmin(room[k].high, needed.high)
            empty |= low > high
            room[k] = between(low, high)
        d = self.flat.gradient
        added = [one * along for one, along in zip(room, self._along(d), strict=True)]
        product = total([self.flat.along(d), *added])
        found: Array = self.anywhere & (empty | (product.low > 0))
        return found

    def _along(self, direction: Array) -> list[Intervals]:
        """Return the products of a direction in each box, shape (m, 3), with each ∇h."""
        products = exact(direction[:, np.newaxis]) * self.slopes
        return [products[:, k].sum(1) for k in range(self.share.shape[1])]


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
