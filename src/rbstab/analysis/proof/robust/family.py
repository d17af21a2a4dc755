"""A family of energies as one form whose derivatives have wide errors.

A family has the members U = f_0 + Σ w_j f_j with all weights |w_j| <= 1. Whatever is proved from
the bounds of the family holds for each member.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations_with_replacement, product
from typing import Any

import numpy as np

from rbstab.analysis.proof.boxes import ROUNDING_FACTOR
from rbstab.analysis.proof.trigonometric import (
    ROUND_OFF,
    Derivatives,
    TrigonometricForm,
    rigorous_basis,
)
from rbstab.mechanics.numbers import Array

MAX_FORMS = 2000
"""The largest number of forms; so `ROUNDING_FACTOR` bounds the rounding of a sum over them."""


@dataclass(frozen=True, eq=False)
class FormFamily(TrigonometricForm):
    """U = f_0 + Σ w_j f_j with |w_j| <= 1; f_0 is the form itself, in the middle of the family.

    Args:
        others: The forms f_j; their sizes are the largest weights that occur.
        shares: For each f_j, how much of its size depends on each z, shape (forms, z), from 0 to 1.
        reference: A point Θ̂, shape (3,), rad, or None. With it, values are those of U(Θ) - U(Θ̂).
    """

    others: tuple[TrigonometricForm, ...] = ()
    shares: tuple[tuple[float, ...], ...] = ()
    reference: Array | None = field(default=None)

    def above(self, reference: Array) -> "FormFamily":
        """Return the family of the differences U(Θ) - U(Θ̂), both of the same member."""
        return replace(self, reference=reference)

    def rigorous(self, Theta: Array, order: int) -> list[Derivatives]:
        """Return the derivatives of f_0, with errors that include the distance of all members.

        |U - f_0| <= Σ |f_j|, and the same for each derivative.

        Args:
            Theta: The points, shape (m, 3), within ±`reach`.
            order: At most 3.

        Returns:
            The values, and errors by point: both of the shapes (m,), (m, 3), ...
        """
        found, evaluate = [], self._stack.evaluator(Theta)
        for level, error in enumerate(self.errors[: order + 1]):
            values = np.empty((len(Theta), *[3] * level))
            spread = np.empty_like(values)
            for axes in _ascending(level):
                sums = evaluate(axes)
                if not level and self.reference is not None:
                    sums = sums - self._at_reference
                one_error = error[every(axes)]
                size = np.abs(sums[:, 1:]) + one_error[1:]
                width = (size.sum(axis=1) + one_error[0]) * ROUNDING_FACTOR
                for place in set(_orders(axes)):
                    values[every(place)] = sums[:, 0]
                    spread[every(place)] = width
            found.append(Derivatives(values, spread))
        return found

    def derivatives_of_others(self, Theta: Array, level: int) -> Array:
        """Return the derivatives of each f_j at one point to round-off, shape (forms, 3, ...)."""
        found = np.empty((len(self.others), *[3] * level))
        evaluate = self._stack.evaluator(Theta[np.newaxis])
        for axes in _ascending(level):
            sums = evaluate(axes)
            for place in set(_orders(axes)):
                found[every(place)] = sums[0, 1:]
        return found

    def gradients(self, Theta: Array) -> tuple[Array, Array]:
        """Return the gradient of each form, f_0 first, shape (m, 1 + forms, 3).

        Also returns the sum of the bounds on the errors of all of them, shape (3,).
        """
        evaluate = self._stack.evaluator(Theta)
        found = np.stack([evaluate((axis,)) for axis in range(3)], axis=-1)
        return found, self.errors[1].sum(axis=0) * ROUNDING_FACTOR

    def hessians(self, Theta: Array) -> Array:
        """Return the Hessian of each form at one point, f_0 first, shape (1 + forms, 3, 3).

        The errors are bounded by `errors[2]`.
        """
        evaluate = self._stack.evaluator(Theta[np.newaxis])
        found = np.empty((1 + len(self.others), 3, 3))
        for axes in _ascending(2):
            for first, second in _orders(axes):
                found[:, first, second] = evaluate(axes)[0]
        return found

    @cached_property
    def fourth_derivative_bound(self) -> Array:
        """Bounds on the fourth derivatives of all members at any point, shape (3, 3, 3, 3)."""
        bounds = [form.trigonometric_bound(4) for form in (self.middle, *self.others)]
        return np.sum(bounds, axis=0) * ROUNDING_FACTOR

    @property
    def middle(self) -> TrigonometricForm:
        """f_0 alone."""
        return TrigonometricForm(self.quadratic, self.linear, self.coefficients, self.reach)

    @cached_property
    def _stack(self) -> "_Stack":
        if len(self.others) > MAX_FORMS:
            raise OverflowError(f"more than {MAX_FORMS} forms")
        return _stacked([self.middle, *self.others])

    @cached_property
    def errors(self) -> list[Array]:
        """Bounds on the errors of the derivatives of each form, of order 0 to 3.

        Shapes (1 + forms,), (1 + forms, 3), ... A term is a product of a coefficient, which is
        rounded once, up to three multiples k, and three entries of t, each with an error of u. All
        terms are added up in one sum of n, in any order, and then the quadratic part is added,
        after at most ten operations. So fewer than n + 20 roundings occur; the bound allows twice
        as many. The difference of two values has the error of both, and one more rounding.
        """
        stack, found = self._stack, []
        roundings = 2 * len(stack.places) + 40
        for level in range(4):
            sizes = np.zeros((len(stack.linear), *[3] * level))
            for axes in product(range(3), repeat=level):
                counts = [axes.count(axis) for axis in range(3)]
                weights = np.prod(stack.multiples.astype(float) ** counts, axis=1)
                sizes[every(axes)] = weights @ np.abs(stack.coefficients)
            sizes = sizes + stack.quadratic_sizes(level, self.reach)
            found.append(roundings * ROUND_OFF * sizes + np.finfo(float).tiny)
        if self.reference is not None:
            found[0] = 2 * found[0]
        return found

    @cached_property
    def _at_reference(self) -> Array:
        """The value of each form at Θ̂, shape (1, 1 + forms)."""
        assert self.reference is not None
        return self._stack.evaluator(self.reference[np.newaxis])(())


def every(axes: tuple[int, ...]) -> Any:
    """Return the index of the entry at some axes, for each point or form."""
    return (slice(None), *axes)


def _ascending(level: int) -> list[tuple[int, ...]]:
    return list(combinations_with_replacement(range(3), level))


def _orders(axes: tuple[int, ...]) -> list[tuple[int, ...]]:
    """Return all orders of some axes; some may occur twice."""
    if len(axes) < 2:
        return [axes]
    return [
        (axis, *rest)
        for k, axis in enumerate(axes)
        for rest in _orders((*axes[:k], *axes[k + 1 :]))
    ]


@dataclass(frozen=True, eq=False)
class _Stack:
    """Several forms, evaluated together.

    places are the indices a, b, c of the n products t_a t_b t_c that occur, shape (n, 3), and
    multiples the k of each entry. coefficients has the shape (n, forms).
    """

    places: Array
    multiples: Array
    coefficients: Array
    quadratic: Array
    linear: Array

    def evaluator(self, Theta: Array) -> "Callable[[tuple[int, ...]], Array]":
        """Return a function of axes: the derivatives along them at some points, (m, forms)."""
        highest = int(self.multiples.max(initial=0))
        t = rigorous_basis(Theta, highest)
        entries = [t]
        for _ in range(3):
            entries.append(_derivative(entries[-1]))

        def evaluate(axes: tuple[int, ...]) -> Array:
            columns = [
                entries[axes.count(axis)][:, axis][:, self.places[:, axis]] for axis in range(3)
            ]
            waves = (columns[0] * columns[1] * columns[2]) @ self.coefficients
            return waves + self._quadratic_part(Theta, axes)

        return evaluate

    def _quadratic_part(self, Theta: Array, axes: tuple[int, ...]) -> Array | float:
        if len(axes) == 2:
            return self.quadratic[:, axes[0], axes[1]]
        if len(axes) == 3:
            return 0.0
        rates = np.einsum("mi,fij->mfj", Theta, self.quadratic)
        if len(axes) == 1:
            return rates[:, :, axes[0]] + self.linear[:, axes[0]]
        return 0.5 * np.einsum("mfj,mj->mf", rates, Theta) + Theta @ self.linear.T

    def quadratic_sizes(self, level: int, reach: float) -> Array | float:
        """Return the sums of the magnitudes of the quadratic part's terms, for |θ| <= reach."""
        Q, q = np.abs(self.quadratic), np.abs(self.linear)
        if level == 0:
            return 0.5 * Q.sum(axis=(1, 2)) * reach * reach + q.sum(axis=1) * reach
        if level == 1:
            return Q.sum(axis=1) * reach + q
        return Q if level == 2 else 0.0


def _derivative(t: Array) -> Array:
    """Return dt/dθ: (cos kθ)' = -k sin kθ and (sin kθ)' = k cos kθ."""
    multiples = np.arange(1, (t.shape[-1] + 1) // 2)
    found = np.zeros_like(t)
    found[..., 1::2] = -multiples * t[..., 2::2]
    found[..., 2::2] = multiples * t[..., 1::2]
    return found


def _stacked(forms: list[TrigonometricForm]) -> _Stack:
    size = max(len(form.coefficients) for form in forms)
    whole = np.zeros((len(forms), size, size, size))
    for index, form in enumerate(forms):
        n = len(form.coefficients)
        whole[index, :n, :n, :n] = form.coefficients
    places = np.argwhere(np.any(whole != 0, axis=0))
    coefficients = whole[:, places[:, 0], places[:, 1], places[:, 2]].T.copy()
    return _Stack(
        places,
        (places + 1) // 2,
        coefficients,
        np.array([form.quadratic for form in forms]),
        np.array([form.linear for form in forms]),
    )
