"""Quadratics plus trigonometric polynomials in three angles, with all their derivatives.

f(Θ) = ½ Θ'QΘ + q'Θ + Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3) with t = [1, cos θ, sin θ, cos 2θ, ...].
Guards add their energies, functions of one angle (`guard`); springs and ligaments add functions of
the lengths of their lines (`lines`). Each evaluation takes many points at once and bounds the
rounding errors of its results.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.lines.intervals import Intervals
from rbstab.analysis.proof.lines.line import LinePart
from rbstab.analysis.proof.traced.kinked import KinkedEnergy
from rbstab.mechanics.numbers import Array

ROUND_OFF = 2.0**-53
"""u: the relative error of one operation on doubles."""

MAX_ANGLE = 4.0
"""rad: the default of `TrigonometricForm.reach`, which includes the range of eq. 5."""

Counts = tuple[int, int, int]
"""The number of derivatives along each of the three axes."""


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Derivatives of one order at m points: values of shape (m, 3, ..., 3).

    error, in the shape of one point's values, bounds the rounding error of each value.
    """

    values: Array
    error: Array


@dataclass(frozen=True, eq=False)
class TrigonometricForm:
    """f(Θ) = ½ Θ'QΘ + q'Θ + Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3).

    Args:
        quadratic: Q, shape (3, 3), symmetric.
        linear: q, shape (3,).
        coefficients: C, shape (n, n, n), with n = 2k + 1 for the highest multiple k of an angle.
        reach: The bounds on round-off hold for angles up to this, rad. Sine and cosine have an
            error of u at any angle (`rigorous_basis`); only the quadratic part grows.
        guard: The guards whose energies are added to f; None without one.
        lines: The springs and ligaments whose energies are added to f.

    `round_off`, `fourth_derivative_bound` and `trigonometric_bound` are those of f alone.
    """

    quadratic: Array
    linear: Array
    coefficients: Array
    reach: float = MAX_ANGLE
    guard: Guard | None = None
    lines: tuple[LinePart, ...] = ()

    @cached_property
    def unguarded(self) -> "TrigonometricForm":
        """This form without its guards, with bounds that are computed once."""
        return replace(self, guard=None)

    @cached_property
    def kinks(self) -> tuple[KinkedEnergy, ...]:
        """The lines whose slopes jump."""
        return tuple(line for line in self.lines if isinstance(line, KinkedEnergy))

    @cached_property
    def without_kinks(self) -> "TrigonometricForm":
        """This form without these lines."""
        return replace(self, lines=tuple(one for one in self.lines if one not in self.kinks))

    def without(self, kink: LinePart) -> "TrigonometricForm":
        """Return this form without one of its lines."""
        return replace(self, lines=tuple(line for line in self.lines if line is not kink))

    @property
    def wraps(self) -> bool:
        """Whether whole turns of any angle leave f as it is: then θ and θ + 2π are one pose."""
        winds_up = np.any(self.quadratic) or np.any(self.linear) or self.guard is not None
        return not winds_up and all(line.periodic for line in self.lines)

    def smoothed(self, width: float) -> "TrigonometricForm":
        """Return a form that is smooth where the slopes of lines jump, for descents."""
        return replace(self, lines=tuple(line.smoothed(width) for line in self.lines))

    @cached_property
    def _multiples(self) -> Array:
        """k of each entry of t: 0, 1, 1, 2, 2, ..."""
        return (np.arange(len(self.coefficients)) + 1) // 2

    @cached_property
    def _differentiation(self) -> Array:
        """The matrix that takes t to dt/dθ: (cos kθ)' = -k sin kθ, (sin kθ)' = k cos kθ."""
        differentiation = np.zeros((len(self._multiples), len(self._multiples)))
        for cosine in range(1, len(differentiation), 2):
            differentiation[cosine, cosine + 1] = -self._multiples[cosine]
            differentiation[cosine + 1, cosine] = self._multiples[cosine]
        return differentiation

    def value(self, Theta: Array) -> Array:
        """Return f at points of shape (m, 3), to round-off, shape (m,)."""
        return self.approximate(Theta, 0)[0]

    def approximate(self, Theta: Array, order: int) -> list[Array]:
        """Return the derivatives of order 0 to `order` to round-off, of shapes (m,), (m, 3), ..."""
        t = trigonometric_basis(Theta, self._multiples[-1])
        found = [found.values for found in self.derivatives(t, Theta, order)]
        for axis, part in [] if self.guard is None else self.guard.by_axis:
            for values, added in zip(found, part.approximate(Theta[:, axis], order), strict=True):
                values[along(values, axis)] += added
        for line in self.lines:
            parts = zip(found, line.approximate(Theta, order), strict=True)
            found = [values + added for values, added in parts]
        return found

    def rigorous(self, Theta: Array, order: int) -> list[Derivatives]:
        """Return the derivatives of order 0 to `order` with proved bounds on their errors.

        Args:
            Theta: The points, shape (m, 3), within ±`reach`.
            order: At most 3.
        """
        found = self.derivatives(self.basis(Theta), Theta, order)
        for line in self.lines:
            found = [
                _with_interval(one, added)
                for one, added in zip(found, line.at(Theta, order), strict=True)
            ]
        for axis, part in [] if self.guard is None else self.guard.by_axis:
            bounds = part.at(Theta[:, axis], order)
            found = [
                _plus(one, axis, low, high) for one, low, high in zip(found, *bounds, strict=True)
            ]
        return found

    def basis(self, Theta: Array) -> Array:
        """Return t with proved errors, wide enough for f and its lines, shape (m, 3, n)."""
        others = [form for line in self.lines for form in line.forms]
        highest = max(form._multiples[-1] for form in (self, *others))
        return rigorous_basis(Theta, highest)

    def derivatives(self, t: Array, Theta: Array, order: int) -> list[Derivatives]:
        """Return the derivatives of f of order 0 to `order`, from t of shape (m, 3, n or more)."""
        t = t[:, :, : len(self.coefficients)]
        sums = _mixed_derivatives(self.coefficients, self._differentiation, t, order)
        found = []
        for level in range(order + 1):
            columns = [sums[_counts(axes)] for axes in product(range(3), repeat=level)]
            values = np.stack(columns, axis=1).reshape(-1, *[3] * level)
            values = values + self._polynomial_part(Theta, level)
            found.append(Derivatives(values, self.round_off[level]))
        return found

    def _polynomial_part(self, Theta: Array, level: int) -> Array | float:
        rates = Theta @ self.quadratic
        if level == 0:
            return 0.5 * np.sum(rates * Theta, axis=1) + Theta @ self.linear
        if level == 1:
            return rates + self.linear
        return self.quadratic if level == 2 else 0.0

    @cached_property
    def round_off(self) -> list[Array]:
        """Bounds on the errors of the derivatives of order 0 to 3 at any point."""
        return [self._error(level) for level in range(4)]

    def _error(self, level: int) -> Array:
        """Bound the error of each derivative by the sum of the magnitudes of its terms.

        A term is a product of a coefficient and three entries of t, each with an error of u: also
        the coefficient, which is an exact rational number rounded once (`form_of`). The terms are
        added up in three sums of n: fewer than 4n + 8 roundings. The bound allows twice as many.
        """
        roundings = 8 * len(self.coefficients) + 16
        magnitudes = np.zeros([3] * level)
        for axes in product(range(3), repeat=level):
            weights = [self._multiples.astype(float) ** count for count in _counts(axes)]
            magnitudes[axes] = np.einsum("abc,a,b,c", np.abs(self.coefficients), *weights)
        angles = np.full((1, 3), self.reach)
        widest = TrigonometricForm(np.abs(self.quadratic), np.abs(self.linear), self.coefficients)
        magnitudes = magnitudes + np.squeeze(widest._polynomial_part(angles, level))
        return roundings * ROUND_OFF * magnitudes + np.finfo(float).tiny

    @cached_property
    def noise(self) -> tuple[float, Array]:
        """The size of round-off in the energy, J, and in its slopes, shape (3,).

        It ends searches, and is not proved. `round_off` is, for f alone.
        """
        value, slope = float(self.round_off[0]), self.round_off[1]
        for line in self.lines:
            value, slope = value + line.noise[0], slope + line.noise[1]
        return value, slope

    @cached_property
    def steepest(self) -> Array:
        """Bounds on the slopes of all but the quadratic part and the guard, shape (3,), J/rad."""
        lines = sum((line.steepest for line in self.lines), start=np.zeros(3))
        return (self.trigonometric_bound(1) + lines) * (1 + 1e-12)

    @cached_property
    def largest(self) -> float:
        """A bound on the magnitude of all but the quadratic part and the guard, J."""
        lines = sum(line.largest for line in self.lines)
        return (float(self.trigonometric_bound(0)) + lines) * (1 + 1e-12)

    @cached_property
    def fourth_derivative_bound(self) -> Array:
        """Bounds on the fourth derivatives at any point, shape (3, 3, 3, 3)."""
        return self.trigonometric_bound(4)

    def trigonometric_bound(self, order: int) -> Array:
        """Bound the derivatives of the trigonometric part at any point, shape (3, ..., 3).

        The eight entries of C for a triple of multiples are multiplied by products of three unit
        vectors (cos, sin). So the Frobenius norm of these entries bounds the sum of the terms.
        """
        highest = self._multiples[-1]
        found = np.zeros([3] * order)
        for multiples in product(range(highest + 1), repeat=3):
            block = self.coefficients[np.ix_(*[self._multiples == k for k in multiples])]
            norm = np.sqrt(np.sum(block * block))
            for axes in product(range(3), repeat=order):
                found[axes] += norm * np.prod([float(multiples[axis]) for axis in axes])
        return found * (1 + 1e-12)


def along(values: Array, axis: int) -> tuple[Any, ...]:
    """Return the index of the derivative along one axis alone, for all points."""
    return (slice(None), *(axis,) * (values.ndim - 1))


def _plus(found: Derivatives, axis: int, low: Array, high: Array) -> Derivatives:
    """Add a function of one angle that lies between bounds, at each point."""
    values, error = found.values.copy(), np.array(found.error)
    place = along(values, axis)
    total = values[place] + low
    # The difference and the sum are rounded.
    wider = (high - low + ROUND_OFF * np.abs(total)) * (1 + 1e-12) + np.finfo(float).tiny
    values[place] = total
    error[place[1:]] += wider.max(initial=0.0)
    return Derivatives(values, error * (1 + 1e-12))


def _with_interval(found: Derivatives, added: Intervals) -> Derivatives:
    """Add proved bounds at each point; the error is the largest of all points."""
    values = found.values + added.middle
    wider = (added.radius + 2 * ROUND_OFF * np.abs(values)) * (1 + 1e-12) + np.finfo(float).tiny
    error = found.error + wider.max(axis=0, initial=0.0)
    return Derivatives(values, error * (1 + 1e-12))


def _counts(axes: Iterable[int]) -> Counts:
    """Count the derivatives along each of three axes."""
    listed = list(axes)
    return listed.count(0), listed.count(1), listed.count(2)


def _mixed_derivatives(
    C: Array, differentiation: Array, t: Array, order: int
) -> dict[Counts, Array]:
    """Differentiate Σ C_abc t_a t_b t_c p, q, r times by θ1, θ2, θ3, for all p + q + r <= order."""
    powers = [t]
    for _ in range(order):
        powers.append(powers[-1] @ differentiation.T)
    m, n = len(t), len(C)
    found: dict[Counts, Array] = {}
    for p in range(order + 1):
        first = (powers[p][:, 0] @ C.reshape(n, n * n)).reshape(m, n, n)
        for q in range(order + 1 - p):
            second = np.einsum("mj,mjk->mk", powers[q][:, 1], first)
            for r in range(order + 1 - p - q):
                found[p, q, r] = np.einsum("mk,mk->m", powers[r][:, 2], second)
    return found


def trigonometric_basis(Theta: Array, highest: int) -> Array:
    """Return t = [1, cos θ, sin θ, cos 2θ, ...] of each angle, to round-off, shape (m, 3, n)."""
    columns = [np.ones_like(Theta)]
    for k in range(1, highest + 1):
        columns += [np.cos(k * Theta), np.sin(k * Theta)]
    return np.stack(columns, axis=-1)


def rigorous_basis(Theta: Array, highest: int) -> Array:
    """Return t as `trigonometric_basis` does, with proved errors of at most u, by python-flint."""
    from flint import arb, ctx  # imported late, as in `polynomial`

    different, places = np.unique(Theta, return_inverse=True)
    rows = []
    with ctx.workprec(80):  # so that rounding to 53 bits happens once, at the end
        for angle in different.tolist():
            row = [1.0]
            for k in range(1, highest + 1):
                sine, cosine = (k * arb(angle)).sin_cos()
                row += [float(cosine), float(sine)]
            rows.append(row)
    table = np.array(rows).reshape(-1, 2 * highest + 1)
    return table[places.reshape(Theta.shape)]
