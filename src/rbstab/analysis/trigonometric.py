"""Quadratics plus trigonometric polynomials in three angles, with all their derivatives.

f(Θ) = ½ Θ'QΘ + q'Θ + Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3) with t = [1, cos θ, sin θ, cos 2θ, ...].
Each evaluation takes many points at once and says how far rounding can have moved the result.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, cached_property
from itertools import product

import numpy as np

from rbstab.analysis.polynomial import Polynomial, fraction
from rbstab.mechanics.numbers import Array

ROUND_OFF = 2.0**-53
"""u: the relative error of one operation on doubles."""

LARGEST_ANGLE = 4.0
"""rad: the bounds on round-off hold for angles up to this, which the range of eq. 5 is within."""

Exponents = tuple[int, ...]


class NotTrigonometric(Exception):
    """A polynomial has a term that is neither quadratic in Θ nor of sines and cosines alone."""


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Derivatives of one order at m points: values of shape (m, 3, ..., 3).

    error, of the shape of one point's values, bounds what rounding has done to each of them.
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
    """

    quadratic: Array
    linear: Array
    coefficients: Array

    @cached_property
    def _multiples(self) -> Array:
        """k of each entry of t: 0, 1, 1, 2, 2, ..."""
        return (np.arange(len(self.coefficients)) + 1) // 2

    @cached_property
    def _slope(self) -> Array:
        """The matrix that takes t to dt/dθ: (cos kθ)' = -k sin kθ, (sin kθ)' = k cos kθ."""
        slope = np.zeros((len(self._multiples), len(self._multiples)))
        for cosine in range(1, len(slope), 2):
            slope[cosine, cosine + 1] = -self._multiples[cosine]
            slope[cosine + 1, cosine] = self._multiples[cosine]
        return slope

    def value(self, Theta: Array) -> Array:
        """F at points of shape (m, 3), to round-off, shape (m,)."""
        return self.to_round_off(Theta, 0)[0]

    def to_round_off(self, Theta: Array, order: int) -> list[Array]:
        """The derivatives of order 0 to `order` at points, of shapes (m,), (m, 3), (m, 3, 3), ..."""
        t = circular(Theta, self._multiples[-1])
        return [found.values for found in self.derivatives(t, Theta, order)]

    def rigorous(self, Theta: Array, order: int) -> list[Derivatives]:
        """The derivatives of order 0 to `order` at points, with proved bounds on their errors.

        Args:
            Theta: Shape (m, 3), within ±`LARGEST_ANGLE`.
            order: At most 3.
        """
        return self.derivatives(proved_circular(Theta, self._multiples[-1]), Theta, order)

    def derivatives(self, t: Array, Theta: Array, order: int) -> list[Derivatives]:
        """The derivatives of order 0 to `order`, from t of shape (m, 3, n)."""
        sums = _mixed_derivatives(self.coefficients, self._slope, t, order)
        found = []
        for level in range(order + 1):
            values = np.empty((len(Theta), *[3] * level))
            for axes in product(range(3), repeat=level):
                values[(slice(None), *axes)] = sums[_counts(axes)]
            values = values + self._polynomial_part(Theta, level)
            found.append(Derivatives(values, self._errors[level]))
        return found

    def _polynomial_part(self, Theta: Array, level: int) -> Array | float:
        rates = Theta @ self.quadratic
        if level == 0:
            return 0.5 * np.sum(rates * Theta, axis=1) + Theta @ self.linear
        if level == 1:
            return rates + self.linear
        return self.quadratic if level == 2 else 0.0

    @cached_property
    def _errors(self) -> list[Array]:
        return [self._error(level) for level in range(4)]

    def _error(self, level: int) -> Array:
        """A bound on the error of each derivative by the sum of the magnitudes of its terms.

        A term is a product of a coefficient and three entries of t, each with an error of u, and
        is added up in three sums of n: fewer than 4n + 8 roundings. Twice as many are allowed for.
        """
        roundings = 8 * len(self.coefficients) + 16
        magnitudes = np.zeros([3] * level)
        for axes in product(range(3), repeat=level):
            weights = [self._multiples.astype(float) ** count for count in _counts(axes)]
            magnitudes[axes] = np.einsum("abc,a,b,c", np.abs(self.coefficients), *weights)
        angles = np.full((1, 3), LARGEST_ANGLE)
        widest = TrigonometricForm(np.abs(self.quadratic), np.abs(self.linear), self.coefficients)
        magnitudes = magnitudes + np.squeeze(widest._polynomial_part(angles, level))
        return roundings * ROUND_OFF * magnitudes + np.finfo(float).tiny

    @cached_property
    def fourth_derivative_bound(self) -> Array:
        """Bounds on the fourth derivatives, anywhere, shape (3, 3, 3, 3).

        For each triple of multiples the eight entries of C stand with products of unit vectors
        (cos, sin), so their Frobenius norm bounds their sum.
        """
        most = self._multiples[-1]
        found = np.zeros([3] * 4)
        for multiples in product(range(most + 1), repeat=3):
            block = self.coefficients[np.ix_(*[self._multiples == k for k in multiples])]
            norm = np.sqrt(np.sum(block * block))
            for axes in product(range(3), repeat=4):
                found[axes] += norm * np.prod([float(multiples[axis]) for axis in axes])
        return found * (1 + 1e-12)


def _counts(axes: Iterable[int]) -> tuple[int, int, int]:
    """How often each of three axes is derived along."""
    listed = list(axes)
    return listed.count(0), listed.count(1), listed.count(2)


def _mixed_derivatives(C: Array, slope: Array, t: Array, order: int) -> dict[Exponents, Array]:
    """Σ C_abc t_a t_b t_c derived p, q and r times along the axes, for all p + q + r <= order."""
    powers = [t]
    for _ in range(order):
        powers.append(powers[-1] @ slope.T)
    m, n = len(t), len(C)
    found = {}
    for p in range(order + 1):
        first = (powers[p][:, 0] @ C.reshape(n, n * n)).reshape(m, n, n)
        for q in range(order + 1 - p):
            second = np.einsum("mj,mjk->mk", powers[q][:, 1], first)
            for r in range(order + 1 - p - q):
                found[p, q, r] = np.einsum("mk,mk->m", powers[r][:, 2], second)
    return found


def circular(Theta: Array, highest: int) -> Array:
    """t = [1, cos θ, sin θ, cos 2θ, ...] of each angle, to round-off, shape (m, 3, n)."""
    columns = [np.ones_like(Theta)]
    for k in range(1, highest + 1):
        columns += [np.cos(k * Theta), np.sin(k * Theta)]
    return np.stack(columns, axis=-1)


def proved_circular(Theta: Array, highest: int) -> Array:
    """The same with errors that are proved to be at most u: from python-flint's intervals."""
    from flint import arb, ctx  # late, as in `polynomial`

    different, places = np.unique(Theta, return_inverse=True)
    rows = []
    with ctx.workprec(80):  # to round to 53 digits once, at the end
        for angle in different.tolist():
            row = [1.0]
            for k in range(1, highest + 1):
                sine, cosine = (k * arb(angle)).sin_cos()
                row += [float(cosine), float(sine)]
            rows.append(row)
    return np.array(rows)[places.reshape(Theta.shape)]


def form_of(polynomial: Polynomial) -> TrigonometricForm:
    """The form that a polynomial without lengths is; each coefficient is rounded once.

    Raises:
        NotTrigonometric: It has another term.
    """
    terms = list(polynomial.terms())
    most = max((s + c for powers, _ in terms for s, c in zip(powers[3:6], powers[6:9])), default=0)
    quadratic, linear = np.zeros((3, 3)), np.zeros(3)
    exact: dict[Exponents, Fraction] = {}
    for powers, value in terms:
        angles, coefficient = powers[0:3], fraction(value)
        if sum(angles) == 0:
            _add_product(exact, coefficient, powers[3:6], powers[6:9])
        elif sum(angles) > 2 or any(powers[3:]):
            raise NotTrigonometric
        elif sum(angles) == 1:
            linear[angles.index(1)] = float(coefficient)
        else:
            i, j = [axis for axis in range(3) for _ in range(angles[axis])]
            quadratic[i, j] = quadratic[j, i] = float(coefficient * (2 if i == j else 1))
    coefficients = np.zeros([2 * most + 1] * 3)
    for place, coefficient in exact.items():
        coefficients[place] = float(coefficient)
    return TrigonometricForm(quadratic, linear, coefficients)


def _add_product(
    exact: dict[Exponents, Fraction], coefficient: Fraction, sines: Exponents, cosines: Exponents
) -> None:
    """Add a coefficient times Π sinᵖ θ cosᵠ θ to a table of coefficients of t_a t_b t_c."""
    factors = [_power_in_multiples(s, c).items() for s, c in zip(sines, cosines, strict=True)]
    for (a, x), (b, y), (c, z) in product(*factors):
        exact[a, b, c] = exact.get((a, b, c), Fraction(0)) + coefficient * x * y * z


@cache
def _power_in_multiples(sines: int, cosines: int) -> dict[int, Fraction]:
    """Sinᵖ θ cosᵠ θ as a sum of the entries of t: their places and coefficients."""
    if sines + cosines == 0:
        return {0: Fraction(1)}
    by_sine = sines > 0
    rest = _power_in_multiples(sines - by_sine, cosines - (not by_sine))
    found: dict[int, Fraction] = {}
    for place, value in rest.items():
        for target, factor in _times(place, by_sine):
            found[target] = found.get(target, Fraction(0)) + value * factor
    return found


def _times(place: int, by_sine: bool) -> list[tuple[int, Fraction]]:
    """One entry of t times sin θ or cos θ, by the product formulas."""
    k, half = (place + 1) // 2, Fraction(1, 2)
    if k == 0:
        return [(2 if by_sine else 1, Fraction(1))]
    is_sine = place % 2 == 0
    up, down = 2 * k + 1, 2 * k - 3  # the places of cos (k+1)θ and cos (k-1)θ
    to_sine = is_sine != by_sine
    # sin k cos 1 and cos k sin 1 give sines, cos k cos 1 and sin k sin 1 give cosines.
    signs = {(False, False): (1, 1), (False, True): (1, -1), (True, False): (1, 1)}
    first, second = signs.get((is_sine, by_sine), (-1, 1))
    if k == 1:
        lower = [] if to_sine else [(0, second * half)]
    else:
        lower = [(down + to_sine, second * half)]
    return [(up + to_sine, first * half), *lower]
