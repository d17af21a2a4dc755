"""Zeros of ∇U where the slope of an element of a user jumps: on the surface h(Θ) = 0.

F is U without the part max(h, 0), or min(h, 0). The body is at rest at Θ if h = 0 and ∇F + λ∇h = 0
for some λ between 0 and 1. These are four equations for the four unknowns Θ and λ:

    G(Θ, λ) = [∇F + λ∇h, h] = 0,        J = ∂G/∂(Θ, λ) = [[∇²F + λ∇²h, ∇h], [∇h', 0]].

J is symmetric. It has one negative eigenvalue more than ∇²F + λ∇²h along the surface. The index of
a rest state on a ridge, min(h, 0), is one more too, as U falls on both sides of the ridge.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.proof.box_bounds import Enclosure
from rbstab.analysis.proof.boxes import ROUNDING_FACTOR, Boxes, box_around, joined
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.formulas.functions import reciprocal
from rbstab.analysis.proof.index import proved_index
from rbstab.analysis.proof.lines.intervals import Intervals, exact
from rbstab.analysis.proof.traced.kinked import ArgumentBounds, KinkedEnergy
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.proof.zero import MAX_STEP, NEWTON_STEPS, RADII, Zero
from rbstab.mechanics.numbers import Array

NEAR = 1e-9
"""rad: a point this close to a surface h = 0, or closer, may be on it."""

REACH = 4.0
"""λ, in units of an angle, is looked for in an interval so many times as wide as that of angles."""


@dataclass(frozen=True, eq=False)
class Surface:
    """The surface h = 0 of a part of U.

    Args:
        form: U.
        kink: The part.
    """

    form: TrigonometricForm
    kink: KinkedEnergy

    @property
    def others(self) -> TrigonometricForm:
        """F."""
        return self.form.without(self.kink)

    def is_near(self, Theta: Array) -> bool:
        """Return whether a point, shape (3,), may be on the surface, as where h and ∇h are zero."""
        h, slopes = self.kink.argument.approximate(Theta[np.newaxis], 1)
        return bool(np.abs(h[0]) <= NEAR * np.abs(slopes[0]).max())

    def normal(self, Theta: Array) -> Array:
        """Return ∇h at a point, to round-off, shape (3,)."""
        found: Array = self.kink.argument.approximate(Theta[np.newaxis], 1)[1][0]
        return found

    @np.errstate(all="ignore")  # comparisons with NaN are false
    def newton(self, starts: Array) -> tuple[Array, Array]:
        """Run Newton's method for G = 0 from many points at once.

        Returns:
            The end points, shape (m, 3), and the last steps, as `zero.newton` returns them. Where λ
            is not between 0 and 1, the last step is infinite.
        """
        others, argument, Theta = self.others, self.kink.argument, starts.copy()
        last, share = np.full(len(starts), np.inf), None
        for _ in range(NEWTON_STEPS):
            _, gradient, hessian = others.approximate(Theta, 2)
            h, slopes, bent = argument.approximate(Theta, 2)
            if share is None:
                squares = np.einsum("mk,mk->m", slopes, slopes)
                share = np.clip(-np.einsum("mk,mk->m", gradient, slopes) / squares, 0.0, 1.0)
            J = np.zeros((len(Theta), 4, 4))
            J[:, :3, :3] = hessian + share[:, np.newaxis, np.newaxis] * bent
            J[:, :3, 3] = J[:, 3, :3] = slopes
            residual = np.concatenate(
                [gradient + share[:, np.newaxis] * slopes, h[:, None]], axis=1
            )
            step = _solved(J, residual)
            last = np.abs(step[:, :3]).max(axis=1)
            shortened = step * np.minimum(1.0, MAX_STEP / last)[:, np.newaxis]
            shortened = np.where(np.isfinite(shortened), shortened, 0.0)
            Theta, share = Theta - shortened[:, :3], share - shortened[:, 3]
            if not np.any(last > 1e-13):
                break
        assert share is not None
        return Theta, np.where((share > 0) & (share < 1), last, np.inf)

    @np.errstate(all="ignore")
    def isolated_zero(self, Theta: Array) -> Zero | None:
        """Prove that a zero near a point exists and is unique; None if that fails.

        In the domain, λ can only be strictly between 0 and 1. So nothing is at rest beside the
        surface, and G is one to one.
        """
        boxes = joined([box_around(Theta, radius) for radius in RADII])
        found = self._over(boxes)
        inverse = _inverse(found.jacobian(found.share).middle[0])
        if inverse is None:
            return None
        unique = found.balanced & (_residual(inverse, found.jacobian(found.share)) < 1)
        exactly_one = np.flatnonzero(unique & found.has_zero(inverse, boxes.inner_radius))
        if not len(exactly_one):
            return None
        widest = np.flatnonzero(unique)[-1]
        return Zero(Theta, boxes[exactly_one[:1]], boxes[widest : widest + 1], at_kink=True)

    @np.errstate(all="ignore")
    def index(self, box: Boxes) -> int | None:
        """Return the proved index in the enclosure of a zero: the number of directions of descent.

        It is that of ∇²F + λ∇²h along the surface, and one more on a ridge.
        """
        found = self._over(box)
        if not found.balanced[0]:
            return None
        J = found.jacobian(found.share)
        index = proved_index(J.middle[0], J.radius[0])
        return None if index is None else index - 1 + int(self.kink.ridge)

    @np.errstate(all="ignore")
    def approximate_index(self, Theta: Array) -> int:
        """Return the same index at a point, to round-off."""
        gradient, hessian = self.others.approximate(Theta[np.newaxis], 2)[1:]
        _, slopes, bent = self.kink.argument.approximate(Theta[np.newaxis], 2)
        share = -float(gradient[0] @ slopes[0]) / float(slopes[0] @ slopes[0])
        along = np.linalg.svd(slopes)[2][1:]
        eigenvalues = np.linalg.eigvalsh(along @ (hessian[0] + share * bent[0]) @ along.T)
        return int(np.sum(eigenvalues < 0)) + int(self.kink.ridge)

    def _over(self, boxes: Boxes) -> "_Equations":
        """Return the bounds on F and h over boxes with one centre."""
        return _Equations.of(enclosure(self.others, boxes), self.kink.bounds(boxes))


def surfaces(form: TrigonometricForm) -> list[Surface]:
    """Return the surfaces on which slopes of elements of users jump."""
    return [Surface(form, one) for one in form.kinks]


def surface_at(form: TrigonometricForm, Theta: Array) -> Surface | None:
    """Return the only surface on which a point may be; None if there is none, or more than one."""
    near = [one for one in surfaces(form) if one.is_near(Theta)]
    return near[0] if len(near) == 1 else None


class _Equations(NamedTuple):
    """Proved bounds on G and J over boxes, with λ in a unit in which J is well scaled.

    Attributes:
        others: Those on F.
        argument: Those on h.
        unit: λ is this times μ, 1/rad.
        share: λ for all zeros in each box, shape (m,).
        balanced: Whether it is strictly between 0 and 1.
    """

    others: Enclosure
    argument: ArgumentBounds
    unit: float
    share: Intervals
    balanced: Array

    @classmethod
    def of(cls, others: Enclosure, argument: ArgumentBounds) -> "_Equations":
        """Return the bounds, with λ from n'∇F + λn'∇h = 0, where n is ∇h at the centre."""
        n = argument.slopes.middle
        pressing = -others.along(n)
        steepness = (exact(n) * argument.slopes_over).sum(1)
        share = pressing * reciprocal(steepness)[0]
        balanced = (steepness.low > 0) & (share.low > 0) & (share.high < 1)
        stiffness, slope = np.abs(others.hessian[0]).max(), np.abs(n[0]).max()
        return cls(others, argument, float(stiffness / slope), share, balanced)

    def jacobian(self, share: Intervals) -> Intervals:
        """Return J over the boxes for some λ, with the last row and column times `unit`."""
        m, others = len(self.others.radius), self.others
        hessian = Intervals(others.hessian, others.hessian_radius)
        block = hessian + share[:, np.newaxis, np.newaxis] * self.argument.hessian_over
        border = self.argument.slopes_over * Intervals(np.array(self.unit), np.array(0.0))
        middle, radius = np.zeros((2, m, 4, 4))
        for whole, inner, outer in (
            (middle, block.middle, border.middle),
            (radius, block.radius, border.radius),
        ):
            whole[:, :3, :3] = inner
            whole[:, :3, 3] = whole[:, 3, :3] = outer
        return Intervals(middle, radius)

    def has_zero(self, inverse: Array, inner_radius: Array) -> Array:
        """Return whether Krawczyk's test finds a zero of G in each box and near some λ, (m,)."""
        centre = float(self.share.middle[0])
        reach = REACH * inner_radius.max(axis=1)
        share = Intervals(np.full(len(reach), centre), reach * self.unit * ROUNDING_FACTOR)
        others, argument = self.others, self.argument
        error = np.broadcast_to(others.gradient_error, others.gradient.shape)
        gradient = Intervals(others.gradient, error)
        sloped = gradient + Intervals(np.array(centre), np.array(0.0)) * argument.slopes
        h = argument.value * Intervals(np.array(self.unit), np.array(0.0))
        middle = np.concatenate([sloped.middle, h.middle[:, np.newaxis]], axis=1)
        radius = np.concatenate([sloped.radius, h.radius[:, np.newaxis]], axis=1)
        size = np.abs(inverse)
        step = np.abs(middle @ inverse.T) + (radius + 1e-14 * np.abs(middle)) @ size.T
        room = np.concatenate([inner_radius, reach[:, np.newaxis]], axis=1)
        wide = np.concatenate([others.radius, reach[:, np.newaxis]], axis=1)
        change = np.einsum("mij,mj->mi", _deviation(inverse, self.jacobian(share)), wide)
        inside = np.all((step + change) * ROUNDING_FACTOR < room, axis=1)
        found: Array = inside & (share.low > 0) & (share.high < 1)
        return found


def _deviation(inverse: Array, J: Intervals) -> Array:
    """Bound |I - YJ| entry by entry, shape (m, 4, 4)."""
    size = np.abs(inverse)
    product = inverse @ J.middle
    error = size @ (J.radius + 1e-14 * np.abs(J.middle))
    found: Array = (np.abs(np.eye(4) - product) + error) * ROUNDING_FACTOR
    return found


def _residual(inverse: Array, J: Intervals) -> Array:
    """Bound the norm of I - YJ, shape (m,)."""
    found: Array = _deviation(inverse, J).sum(axis=2).max(axis=1) * ROUNDING_FACTOR
    return found


def _inverse(matrix: Array) -> Array | None:
    """Return a matrix near the inverse; None if there is none."""
    if not np.all(np.isfinite(matrix)):
        return None
    try:
        found: Array = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return None
    return found if np.all(np.isfinite(found)) else None


def _solved(matrices: Array, right: Array) -> Array:
    """Return the solutions of linear systems, shape (m, n); no numbers of a singular one."""
    regular: Any = np.isfinite(matrices).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
    regular[regular] = np.linalg.det(matrices[regular]) != 0
    found = np.full_like(right, np.nan)
    if np.any(regular):
        found[regular] = np.linalg.solve(matrices[regular], right[regular, :, np.newaxis])[..., 0]
    return found
