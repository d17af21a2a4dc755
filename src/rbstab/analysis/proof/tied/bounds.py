"""Rigorous bounds on the derivatives of W(Θ, z) over boxes of Θ and z.

With the unit vector u_j = e_j/|e_j| and the matrix P_j = (I - u_j u_j')/|e_j|,

    ∂W/∂θ_i = ∂U/∂θ_i + Σ w_j u_j'r_j,i        ∂W/∂z = Sz + Σ w_j u_j
    ∂²W/∂θ_i∂θ_k = ∂²U/∂θ_i∂θ_k + Σ w_j (u_j'r_j,ik + r_j,i'P_j r_j,k)
    ∂²W/∂θ_i∂z = Σ w_j P_j r_j,i               ∂²W/∂z² = S + Σ w_j P_j

U and r_j are enclosed over a box as in `enclosure`, a barrier on θ2 by its values at the ends. u_j
is enclosed entry by entry, which is sharp: e/√(e² + q²) grows with e, and |u| is never above 1,
also where a line may have no length.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.lines.directions import direction, products
from rbstab.analysis.proof.lines.intervals import (
    Intervals,
    between,
    near,
    rounded,
    stacked,
    total,
)
from rbstab.analysis.proof.lines.over_boxes import at_centres, over_boxes
from rbstab.analysis.proof.tied.energy import TiedEnergy
from rbstab.analysis.proof.trigonometric import TrigonometricForm, along
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH

Orders = list[Intervals]
"""Derivatives of order 0, 1 and 2."""


class Pose:
    """U and all r_j over boxes of Θ, and at their centres.

    Args:
        energy: W.
        Theta: The boxes of Θ.
    """

    def __init__(self, energy: TiedEnergy, Theta: Boxes) -> None:
        self.energy = energy
        forms = [energy.form, *(form for line in energy.lines for form in line.offset)]
        t = max(forms, key=lambda form: len(form.coefficients)).basis(Theta.centre)
        found = [_both(form, t, Theta) for form in forms]
        if energy.form.guard is not None:
            found[0] = _guarded(*found[0], energy.form.guard, Theta)
        self.at_centre = [one for one, _ in found]
        self.over = [one for _, one in found]

    def __getitem__(self, chosen: Array) -> "Pose":
        part = object.__new__(Pose)
        part.energy = self.energy
        part.at_centre = [[one[chosen] for one in orders] for orders in self.at_centre]
        part.over = [[one[chosen] for one in orders] for orders in self.over]
        return part

    def at(self, z: Array) -> "Bounds":
        """Return the bounds at the centres, with z of shape (m, 3)."""
        return self.of(self.at_centre, Intervals(z, np.zeros_like(z)))

    def within(self, z: Boxes) -> "Bounds":
        """Return the bounds over the boxes, with boxes of z."""
        return self.of(self.over, between(z.low, z.high))

    def of(self, orders: list[Orders], z: Intervals) -> "Bounds":
        """Return the bounds of `at_centre` or `over` with z, shape (m, 3)."""
        lines = []
        for k, line in enumerate(self.energy.lines):
            r = [self._line(orders, k, order) for order in range(3)]
            lines.append(LineBounds(line.weight, z + r[0], r[1], r[2]))
        return Bounds(self.energy, orders[0], z, lines)

    def offset(self, orders: list[Orders], line: int) -> Intervals:
        """Return r of a line, shape (m, 3)."""
        return self._line(orders, line, 0)

    def slopes(self, line: int) -> Intervals:
        """Return ∂r_k/∂θ_i of a line over the boxes, shape (m, 3, 3)."""
        return self._line(self.over, line, 1)

    def _line(self, orders: list[Orders], line: int, order: int) -> Intervals:
        offset = orders[1 + 3 * line : 4 + 3 * line]
        return stacked([entry[order] for entry in offset])


def _both(form: TrigonometricForm, t: Array, Theta: Boxes) -> tuple[Orders, Orders]:
    """Return a form and its derivatives at the centres, and over the boxes."""
    found = at_centres(form, t, Theta)
    return found[:3], over_boxes(found, Theta.radius)[:3]


def _guarded(at_centre: Orders, over: Orders, guard: Guard, Theta: Boxes) -> tuple[Orders, Orders]:
    """Add a barrier on θ2: its bounds over the boxes are exact, those of Taylor's theorem wide."""
    bounds = guard.over(Theta.low[:, 1], Theta.high[:, 1])
    return _plus(at_centre, guard.at(Theta.centre[:, 1], 2)), _plus(over, bounds)


def _plus(orders: Orders, bounds: tuple[Array, Array]) -> Orders:
    """Add a function of θ2 alone, whose derivatives lie between bounds."""
    found = []
    for one, low, high in zip(orders, *(rows[:3] for rows in bounds), strict=True):
        added, of_guard = between(low, high), Intervals(*np.zeros((2, *one.middle.shape)))
        of_guard.middle[along(one.middle, PITCH)] = added.middle
        of_guard.radius[along(one.middle, PITCH)] = added.radius
        found.append(one + of_guard)
    return found


@dataclass(frozen=True, eq=False)
class LineBounds:
    """Bounds on w|e| and its derivatives, with e of shape (m, 3).

    slopes are ∂e_k/∂θ_i, shape (m, 3, 3), and bends ∂²e_k/∂θ_i∂θ_l, shape (m, 3, 3, 3).
    """

    weight: float
    e: Intervals
    slopes: Intervals
    bends: Intervals

    @cached_property
    def squared(self) -> Intervals:
        """|e|², shape (m,)."""
        return self.e.square().sum(1)

    @cached_property
    def pull(self) -> Intervals:
        """w u, shape (m, 3)."""
        return near(self.weight) * self.direction

    @cached_property
    def direction(self) -> Intervals:
        """u, shape (m, 3); within [-1, 1] where e may be zero."""
        return direction(self.e)

    @cached_property
    def bend(self) -> Intervals:
        """w P = w (I - uu')/|e|, shape (m, 3, 3); no bound where e may be zero."""
        unit = Intervals(np.eye(3), np.zeros((3, 3)))
        factor = near(self.weight) * self.squared.negative_power(1)
        return factor[:, np.newaxis, np.newaxis] * (unit + -products(self.direction))

    @cached_property
    def bent_slopes(self) -> Intervals:
        """w P ∂e/∂θ_i, shape (m, 3, 3): the second index is that of the angle."""
        return (self.bend[:, :, :, np.newaxis] * self.slopes[:, np.newaxis, :, :]).sum(2)

    @property
    def moment(self) -> Intervals:
        """w u'∂e/∂θ_i, shape (m, 3)."""
        return (self.pull[:, :, np.newaxis] * self.slopes).sum(1)

    @property
    def turned(self) -> Intervals:
        """w (u'∂²e/∂θ_i∂θ_l + ∂e/∂θ_i'P ∂e/∂θ_l), shape (m, 3, 3)."""
        straight = (self.pull[:, :, np.newaxis, np.newaxis] * self.bends).sum(1)
        bent = self.slopes[:, :, :, np.newaxis] * self.bent_slopes[:, :, np.newaxis, :]
        return straight + bent.sum(1)


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds on W and its derivatives at m points, or over m boxes."""

    energy: TiedEnergy
    form: Orders
    z: Intervals
    lines: list[LineBounds]

    @property
    def force(self) -> Intervals:
        """Σ w_j u_j, shape (m, 3)."""
        nothing = Intervals(*np.zeros((2, *self.z.middle.shape)))
        return total([nothing, *(line.pull for line in self.lines)])

    @property
    def pulled(self) -> Intervals:
        """Sz, shape (m, 3)."""
        return (rounded(self.energy.stiffness) * self.z[:, np.newaxis, :]).sum(2)

    @property
    def value(self) -> Intervals:
        """W, shape (m,)."""
        lines = [near(line.weight) * line.squared.root() for line in self.lines]
        stored = (self.pulled * self.z).sum(1)
        return total([self.form[0], near(0.5) * stored, *lines])

    @property
    def gradient(self) -> Intervals:
        """∇W, shape (m, 6)."""
        moment = total([self.form[1], *(line.moment for line in self.lines)])
        return _joined([moment, self.pulled + self.force], 1)

    @property
    def hessian(self) -> Intervals:
        """The Hessian of W, shape (m, 6, 6); no bound where a line may have no length."""
        turned = total([self.form[2], *(line.turned for line in self.lines)])
        mixed = total([line.bent_slopes for line in self.lines])
        bend = total([line.bend for line in self.lines]) + rounded(self.energy.stiffness)
        transposed = Intervals(mixed.middle.swapaxes(1, 2), mixed.radius.swapaxes(1, 2))
        return _joined([_joined([turned, transposed], 2), _joined([mixed, bend], 2)], 1)

    @property
    def shift(self) -> Intervals:
        """-S⁻¹Σ w_j u_j, shape (m, 3): at a rest state it is z."""
        found = (rounded(self.energy.compliance) * self.force[:, np.newaxis, :]).sum(2)
        return -found

    @property
    def unbalanced(self) -> Array:
        """Whether a force cannot balance that of a line with a length, shape (m,).

        At a rest state |Sz + Σ w_i u_i| = |w_j|, where i runs over all other lines.
        """
        found = np.zeros(len(self.z.middle), dtype=bool)
        for k, line in enumerate(self.lines):
            others = [other.pull for other in self.lines[:k] + self.lines[k + 1 :]]
            squared = total([self.pulled, *others]).square().sum(1)
            wanted = near(line.weight).square()
            found |= (squared.low > wanted.high) | (squared.high < wanted.low)
        return found


def _joined(parts: list[Intervals], axis: int) -> Intervals:
    return Intervals(
        np.concatenate([part.middle for part in parts], axis=axis),
        np.concatenate([part.radius for part in parts], axis=axis),
    )
