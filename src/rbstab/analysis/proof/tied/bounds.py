"""Rigorous bounds on the derivatives of W(Θ, z) over boxes of Θ and z.

With the unit vector u_j = e_j/|e_j| and the matrix P_j = (I - u_j u_j')/|e_j|,

    ∂W/∂θ_i = ∂U/∂θ_i + Σ w_j u_j'r_j,i        ∂W/∂z = Sz + Σ w_j u_j
    ∂²W/∂θ_i∂θ_k = ∂²U/∂θ_i∂θ_k + Σ w_j (u_j'r_j,ik + r_j,i'P_j r_j,k)
    ∂²W/∂θ_i∂z = Σ w_j P_j r_j,i               ∂²W/∂z² = S + Σ w_j P_j

Of a ligament, w u is its pull, and w P the derivative of its pull by e. The formulas of users add
their derivatives. U and r_j are enclosed over a box as in `enclosure`, a barrier on θ2 by its
values at the ends. u_j is enclosed entry by entry, which is sharp: e/√(e² + q²) grows with e, and
|u| is never above 1, also where a line may have no length.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.formulas import jets
from rbstab.analysis.proof.formulas.jets import Jet
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.ligaments.free import FreeLigament
from rbstab.analysis.proof.lines.directions import direction, products
from rbstab.analysis.proof.lines.intervals import (
    Intervals,
    between,
    exact,
    near,
    rounded,
    stacked,
    total,
)
from rbstab.analysis.proof.lines.over_boxes import at_centres, over_boxes
from rbstab.analysis.proof.tied.energy import FreeLine, TiedEnergy
from rbstab.analysis.proof.tied.formula import FreeFormula, Place
from rbstab.analysis.proof.trigonometric import TrigonometricForm, along
from rbstab.mechanics.numbers import Array

Orders = list[Intervals]
"""Derivatives of order 0, 1 and 2."""

ANGLES, SHIFT = slice(0, 3), slice(3, 6)
"""The places of Θ and z among the six variables."""


class Forms(NamedTuple):
    """U, all r_j and X* with their derivatives, at points or over boxes of Θ.

    Attributes:
        Theta: Θ, shape (m, 3).
        orders: The forms: U, three of each r_j, and those of X*.
    """

    Theta: Intervals
    orders: list[Orders]

    def chosen(self, chosen: Array) -> "Forms":
        """Return the forms at some of the points, or over some of the boxes."""
        orders = [[one[chosen] for one in orders] for orders in self.orders]
        return Forms(self.Theta[chosen], orders)

    def triple(self, number: int) -> list[Intervals]:
        """Return three forms that belong together, by order: (m, 3), (m, 3, 3), ..."""
        forms = self.orders[1 + 3 * number : 4 + 3 * number]
        return [stacked([entry[order] for entry in forms]) for order in range(3)]


class Pose:
    """U, all r_j and X* over boxes of Θ, and at their centres.

    Args:
        energy: W.
        Theta: The boxes of Θ.
    """

    def __init__(self, energy: TiedEnergy, Theta: Boxes) -> None:
        self.energy = energy
        lines: list[FreeLine | FreeLigament] = [*energy.lines, *energy.ligaments]
        offsets = [form for line in lines for form in line.offset]
        forms = [energy.form, *offsets, *energy.position]
        t = max(forms, key=lambda form: len(form.coefficients)).basis(Theta.centre)
        found = [_both(form, t, Theta) for form in forms]
        if energy.form.guard is not None:
            found[0] = _guarded(*found[0], energy.form.guard, Theta)
        self.at_centre = Forms(exact(Theta.centre), [one for one, _ in found])
        self.over = Forms(Intervals(Theta.centre, Theta.radius), [one for _, one in found])

    def __getitem__(self, chosen: Array) -> "Pose":
        part = object.__new__(Pose)
        part.energy = self.energy
        part.at_centre, part.over = self.at_centre.chosen(chosen), self.over.chosen(chosen)
        return part

    def at(self, z: Array) -> "Bounds":
        """Return the bounds at the centres, with z of shape (m, 3)."""
        return self.of(self.at_centre, exact(z))

    def within(self, z: Boxes) -> "Bounds":
        """Return the bounds over the boxes, with boxes of z."""
        return self.of(self.over, between(z.low, z.high))

    def of(self, forms: Forms, z: Intervals) -> "Bounds":
        """Return the bounds of `at_centre` or `over` with z, shape (m, 3)."""
        energy, lines = self.energy, list[LineBounds]()
        for k, line in enumerate((*energy.lines, *energy.ligaments)):
            value, slopes, bends = forms.triple(k)
            make = SpringBounds if isinstance(line, FreeLine) else LigamentBounds
            lines.append(make(line, z + value, slopes, bends))
        formulas = [self._formula(one, forms, z) for one in energy.formulas]
        return Bounds(energy, forms.orders[0], z, lines, formulas)

    def _formula(self, formula: FreeFormula, forms: Forms, z: Intervals) -> Jet:
        """Return the energy of an element of a user."""
        number = len(self.energy.lines) + len(self.energy.ligaments)
        place = Place(forms.Theta, forms.triple(number), z)
        if not (np.any(forms.Theta.radius) or np.any(z.radius)):
            return formula.at(place)
        at = self.at_centre
        return formula.over(Place(at.Theta, at.triple(number), exact(z.middle)), place)

    def offset(self, forms: Forms, line: int) -> Intervals:
        """Return r of a line, shape (m, 3)."""
        return forms.triple(line)[0]

    def slopes(self, line: int) -> Intervals:
        """Return ∂r_k/∂θ_i of a line over the boxes, shape (m, 3, 3)."""
        return self.over.triple(line)[1]


def _both(form: TrigonometricForm, t: Array, Theta: Boxes) -> tuple[Orders, Orders]:
    """Return a form and its derivatives at the centres, and over the boxes."""
    found = at_centres(form, t, Theta)
    return found[:3], over_boxes(found, Theta.radius)[:3]


def _guarded(at_centre: Orders, over: Orders, guard: Guard, Theta: Boxes) -> tuple[Orders, Orders]:
    """Add guards: their bounds over the boxes are exact, those of Taylor's theorem wide.

    Where the slope of a soft guard jumps, the bounds contain all slopes between both sides, and the
    Hessian has no bound.
    """
    for axis, part in guard.by_axis:
        low, high = Theta.low[:, axis], Theta.high[:, axis]
        at_centre = _plus(at_centre, axis, part.at(Theta.centre[:, axis], 2))
        over = _plus(over, axis, part.over(low, high))
    return at_centre, over


def _plus(orders: Orders, axis: int, bounds: tuple[Array, Array]) -> Orders:
    """Add a function of one angle, whose derivatives lie between bounds."""
    found = []
    for one, low, high in zip(orders, *(rows[:3] for rows in bounds), strict=True):
        added, of_guard = between(low, high), Intervals(*np.zeros((2, *one.middle.shape)))
        of_guard.middle[along(one.middle, axis)] = added.middle
        of_guard.radius[along(one.middle, axis)] = added.radius
        found.append(one + of_guard)
    return found


@dataclass(frozen=True, eq=False)
class LineBounds:
    """Bounds on the energy of a line and its derivatives, with e of shape (m, 3).

    slopes are ∂e_k/∂θ_i, shape (m, 3, 3), and bends ∂²e_k/∂θ_i∂θ_l, shape (m, 3, 3, 3).
    """

    line: Any
    e: Intervals
    slopes: Intervals
    bends: Intervals

    @property
    def value(self) -> Intervals:
        """The energy, shape (m,)."""
        raise NotImplementedError

    @property
    def pull(self) -> Intervals:
        """The derivative of the energy by e, shape (m, 3)."""
        raise NotImplementedError

    @property
    def bend(self) -> Intervals:
        """The second derivatives of the energy by e, shape (m, 3, 3)."""
        raise NotImplementedError

    @cached_property
    def squared(self) -> Intervals:
        """|e|², shape (m,)."""
        return self.e.square().sum(1)

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


class SpringBounds(LineBounds):
    """Bounds on w|e|, the energy of the line of a spring."""

    line: FreeLine

    @property
    def value(self) -> Intervals:
        """w |e|, shape (m,)."""
        return near(self.line.weight) * self.squared.root()

    @cached_property
    def pull(self) -> Intervals:
        """w u, shape (m, 3)."""
        return near(self.line.weight) * self.direction

    @cached_property
    def direction(self) -> Intervals:
        """u, shape (m, 3); within [-1, 1] where e may be zero."""
        return direction(self.e)

    @cached_property
    def bend(self) -> Intervals:
        """w P = w (I - uu')/|e|, shape (m, 3, 3); no bound where e may be zero."""
        unit = exact(np.eye(3))
        factor = near(self.line.weight) * self.squared.negative_power(1)
        return factor[:, np.newaxis, np.newaxis] * (unit + -products(self.direction))


class LigamentBounds(LineBounds):
    """Bounds on the energy of a ligament."""

    line: FreeLigament

    @property
    def value(self) -> Intervals:
        """G, shape (m,)."""
        return self.line.law.bounds(self.squared, 0)[0]

    @cached_property
    def pull(self) -> Intervals:
        """The tension along e, shape (m, 3)."""
        return self.line.pull(self.e)

    @cached_property
    def bend(self) -> Intervals:
        """The derivative of the pull by e, shape (m, 3, 3)."""
        return self.line.bend(self.e)


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds on W and its derivatives at m points, or over m boxes."""

    energy: TiedEnergy
    form: Orders
    z: Intervals
    lines: list[LineBounds]
    formulas: list[Jet]

    @cached_property
    def forces(self) -> list[Intervals]:
        """∂f/∂X of the formulas of users, each of shape (m, 3)."""
        return [jets.gradient(one)[:, SHIFT] for one in self.formulas]

    @property
    def force(self) -> Intervals:
        """∂W/∂z - Sz, shape (m, 3): Σ w_j u_j, and that of ligaments and formulas."""
        nothing = Intervals(*np.zeros((2, *self.z.middle.shape)))
        return total([nothing, *(line.pull for line in self.lines), *self.forces])

    @property
    def pulled(self) -> Intervals:
        """Sz, shape (m, 3)."""
        return (rounded(self.energy.stiffness) * self.z[:, np.newaxis, :]).sum(2)

    @property
    def value(self) -> Intervals:
        """W, shape (m,)."""
        stored = (self.pulled * self.z).sum(1)
        lines = [line.value for line in self.lines]
        formulas = [one.rows[0] for one in self.formulas]
        return total([self.form[0], near(0.5) * stored, *lines, *formulas])

    @property
    def gradient(self) -> Intervals:
        """∇W, shape (m, 6)."""
        turning = [jets.gradient(one)[:, ANGLES] for one in self.formulas]
        moment = total([self.form[1], *(line.moment for line in self.lines), *turning])
        return _joined([moment, self.pulled + self.force], 1)

    @property
    def hessian(self) -> Intervals:
        """The Hessian of W, shape (m, 6, 6); no bound where a spring may have no length."""
        nothing = Intervals(*np.zeros((2, *self.z.middle.shape, 3)))
        turned = total([self.form[2], *(line.turned for line in self.lines)])
        mixed = total([line.bent_slopes for line in self.lines] or [nothing])
        bend = total([line.bend for line in self.lines] or [nothing])
        bend = bend + rounded(self.energy.stiffness)
        transposed = Intervals(mixed.middle.swapaxes(1, 2), mixed.radius.swapaxes(1, 2))
        found = _joined([_joined([turned, transposed], 2), _joined([mixed, bend], 2)], 1)
        return total([found, *(jets.hessian(one) for one in self.formulas)])

    @property
    def shift(self) -> Intervals:
        """-S⁻¹ times the force: at a rest state it is z, shape (m, 3)."""
        found = (rounded(self.energy.compliance) * self.force[:, np.newaxis, :]).sum(2)
        return -found

    @property
    def unbalanced(self) -> Array:
        """Whether a force cannot balance that of a spring with a length, shape (m,).

        At a rest state |Sz + Σ w_i u_i| = |w_j|, where i runs over all other lines and formulas.
        """
        found = np.zeros(len(self.z.middle), dtype=bool)
        for k, spring in enumerate(self.energy.lines):
            others = [line.pull for line in self.lines[:k] + self.lines[k + 1 :]]
            squared = total([self.pulled, *others, *self.forces]).square().sum(1)
            wanted = near(spring.weight).square()
            found |= (squared.low > wanted.high) | (squared.high < wanted.low)
        return found


def _joined(parts: list[Intervals], axis: int) -> Intervals:
    return Intervals(
        np.concatenate([part.middle for part in parts], axis=axis),
        np.concatenate([part.radius for part in parts], axis=axis),
    )
