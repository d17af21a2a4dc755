"""Taylor models: polynomials in τ and z with proved bounds on what they miss.

A model stands for a function of τ and z. It differs from the polynomial by at most the remainder
for all real 0 <= τ <= 1 and |z_i| <= 1. Terms of higher degrees, and all rounding errors, go into
the remainders (K. Makino and M. Berz, 2003).
"""

from dataclasses import dataclass
from functools import cached_property
from math import factorial
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.motion.graph import (
    COSINE,
    EXPONENTIAL,
    INVERSE,
    LOGARITHM,
    PRODUCT,
    ROOT,
    SINE,
    proof_precision,
)
from rbstab.proof.motion.monomials import Monomials
from rbstab.proof.motion.program import Program, Sums
from rbstab.proof.motion.rounding import rounded_up
from rbstab.proof.motion.series import node_series, summed

UNIT = 2.0**-53 * 1.001
"""A sum of n products of doubles has a rounding error of at most n times this, relative to the sum
of the absolute products, for n below 10⁹ (N. Higham, 2002, section 3.1)."""

FUNCTION_TERMS = 8
"""Terms of the series of cosh and sinh, and of cosine and sine."""

ENTIRE = (SINE, COSINE, EXPONENTIAL)
"""Functions with a series that converges everywhere; others are proved from a guess."""


@dataclass(frozen=True, eq=False)
class Models:
    """Taylor models, several at once. A remainder that is not finite is no bound.

    Args:
        space: The monomials in z.
        polynomial: The coefficients of τᵏ z^α, shape (terms, models, sets, monomials).
        remainder: Shape (models, sets).
    """

    space: Monomials
    polynomial: Array
    remainder: Array

    def within(self, apart: Array) -> "Models":
        """Return models of all functions within a further distance, shape (models, sets)."""
        return Models(self.space, self.polynomial, rounded_up(self.remainder + apart))

    def __getitem__(self, chosen: Any) -> "Models":
        """Return some of the models."""
        return Models(self.space, self.polynomial[:, chosen], self.remainder[chosen])

    @cached_property
    def _by_power(self) -> Array:
        """Sums of the absolute coefficients by power of τ, shape (terms, models, sets)."""
        return np.abs(self.polynomial).sum(axis=-1)

    @cached_property
    def _by_degree(self) -> Array:
        """The same by degree in z, shape (degree + 1, models, sets)."""
        first = self.space.first_of_degree
        size = np.add.reduceat(_total(np.abs(self.polynomial)), first, axis=-1)
        return np.ascontiguousarray(np.moveaxis(size, -1, 0))

    @cached_property
    def size(self) -> Array:
        """A bound on the polynomials, shape (models, sets)."""
        bound: Array = rounded_up(_total(self._by_power))
        return bound

    @cached_property
    def bound(self) -> Array:
        """A bound on the functions, shape (models, sets)."""
        found: Array = rounded_up(self.size + self.remainder)
        return found

    def range(self) -> tuple[Array, Array]:
        """Return the least and the largest values, rounded outwards, each (models, sets)."""
        middle = self.polynomial[0, ..., 0]
        middle = np.where(np.isfinite(middle), middle, np.nan)
        spread = rounded_up(self._without_constant().bound)
        return np.nextafter(middle - spread, -np.inf), np.nextafter(middle + spread, np.inf)

    def __mul__(self, other: "Models") -> "Models":
        polynomial = _product(self.space, self.polynomial, other.polynomial)
        operations = len(polynomial) + self.space.most_pairs + 4
        by_size = (1.0 + operations * UNIT) * other.remainder + operations * UNIT * other.size
        error = self.size * by_size + self.remainder * other.bound
        for a, b in ((self._by_power, other._by_power), (self._by_degree, other._by_degree)):
            # What has a higher degree: each degree of one factor with the high ones of the other.
            high = np.cumsum(b[::-1], axis=0)[:-1]
            error = error + _total(a[1:] * high)
        return Models(self.space, polynomial, rounded_up(error))

    def scaled(self, factors: Any) -> "Models":
        """Return each model times a number, known to a relative error of `UNIT`.

        The numbers are one double, or an array of shape (models, 1) or (models, sets).
        """
        wide = factors if np.isscalar(factors) else factors[..., np.newaxis]
        error = np.abs(factors) * ((1.0 + 2 * UNIT) * self.remainder + 4 * UNIT * self.size)
        return Models(self.space, self.polynomial * wide, rounded_up(error))

    def __add__(self, other: "Models") -> "Models":
        error = self.remainder + other.remainder + 2 * UNIT * (self.size + other.size)
        return Models(self.space, self.polynomial + other.polynomial, rounded_up(error))

    def __sub__(self, other: "Models") -> "Models":
        return self + Models(self.space, -other.polynomial, other.remainder)

    def plus(self, constants: Any) -> "Models":
        """Return each model plus a double, in an array of shape (models, sets), or one double."""
        polynomial = self.polynomial.copy()
        polynomial[0, ..., 0] += constants
        error = self.remainder + 2 * UNIT * (self.size + np.abs(constants))
        return Models(self.space, polynomial, rounded_up(error))

    def _without_constant(self) -> "Models":
        polynomial = self.polynomial.copy()
        polynomial[0, ..., 0] = 0.0
        return Models(self.space, polynomial, self.remainder)

    def entire(self, kinds: list[str]) -> "Models":
        """Return sin, cos or exp of each model.

        With x = c + u and g = ±u²: even = Σ gᵏ/(2k)! and u·odd = u Σ gᵏ/(2k + 1)!.
        """
        c, u = self.polynomial[0, ..., 0], self._without_constant()
        sign = np.array([[1.0 if kind == EXPONENTIAL else -1.0] for kind in kinds])
        square = (u * u).scaled(sign)
        even, odd = square.series(0), square.series(1) * u
        by_even, by_odd = _factors(kinds, c)
        # The rest of both series; and the factors, which are sines and cosines to `UNIT`.
        B, power = u.bound, 2 * FUNCTION_TERMS + 2
        rest = np.where(B < 2.0, 8.0 * B**power / factorial(power), np.inf)
        rest = (rest + 2 * UNIT * (even.bound + odd.bound)) * (np.abs(by_even) + np.abs(by_odd))
        total = even.scaled(by_even) + odd.scaled(by_odd)
        return Models(self.space, total.polynomial, rounded_up(total.remainder + rest))

    def series(self, odd: int) -> "Models":
        """Return Σ gᵏ/(2k)! for k up to `FUNCTION_TERMS`, or with `odd` = 1 Σ gᵏ/(2k + 1)!."""
        found = self.scaled(0.0).plus(1.0)
        for n in range(2 * FUNCTION_TERMS + odd, odd, -2):
            found = (self * found).scaled(1.0 / (n * (n - 1))).plus(1.0)
        return found

    def from_guess(self, kind: str, guess: Array) -> "Models":
        """Return 1/x, √x, log x or atan x of each model, near polynomials that need not be good.

        Args:
            kind: The function.
            guess: The polynomials y, in the shape of `polynomial`.
        """
        y = Models(self.space, guess, np.zeros_like(self.remainder))
        if kind == INVERSE:  # 1/x - y = -y e/(1 + e) with e = xy - 1
            E = (self * y).plus(-1.0).bound
            error = y.size * _quotient(E, 1.0 - E)
        elif kind == ROOT:  # √x - y = (x - y²)/(√x + y), and x >= y² - E
            E = (y * y - self).bound
            low, _ = y.range()
            error = np.where((low > 0.0) & (low * low > 1.0001 * E), _quotient(E, low), np.inf)
        elif kind == LOGARITHM:  # log x - y = log(1 + e) with e = x exp(-y) - 1
            E = (self * y.scaled(-1.0).entire([EXPONENTIAL] * len(guess[0]))).plus(-1.0).bound
            error = _quotient(E, 1.0 - E)
        else:  # tan(atan x - y) = (x cos y - sin y)/(cos y + x sin y)
            s, c = (y.entire([one] * len(guess[0])) for one in (SINE, COSINE))
            low, _ = (c + self * s).range()
            error = np.where(y.bound < 3.0, _quotient((self * c - s).bound, low), np.inf)
        return Models(self.space, guess, rounded_up(error))


def evaluated(program: Program, variables: Models, guess: Array | None = None) -> Models:
    """Return the models of a program's results.

    Args:
        program: The program.
        variables: The models of its variables.
        guess: Polynomials near its nodes, shape (terms, nodes, sets, monomials), for functions that
            are proved from a guess; default their series.
    """
    space, given = variables.space, variables.polynomial
    if guess is None and any(one.kind not in (PRODUCT, *ENTIRE) for one in program.operations):
        guess = node_series(program, space, given)
    polynomial = np.zeros((len(given), len(program), *given.shape[2:]))
    remainder = np.zeros((len(program), given.shape[2]))
    size = np.zeros_like(remainder)

    def keep(nodes: slice, models: Models) -> None:
        polynomial[:, nodes], remainder[nodes] = models.polynomial, models.remainder
        size[nodes] = models.size

    with np.errstate(all="ignore"):  # a remainder that is not finite is no bound
        keep(slice(program.variables), variables)
        for one in program.operations:
            x, *more = (_summed(space, sums, polynomial, remainder, size) for sums in one.operands)
            if one.kind == PRODUCT:
                keep(one.nodes, x * more[0])
            elif one.kind in ENTIRE:
                keep(one.nodes, x.entire([one.kind] * len(x.remainder)))
            else:
                assert guess is not None
                keep(one.nodes, x.from_guess(one.kind, guess[:, one.nodes]))
        return _summed(space, program.results, polynomial, remainder, size)


def _summed(
    space: Monomials, sums: Sums, polynomial: Array, remainder: Array, size: Array
) -> Models:
    """Return sums of models."""
    error = sums.constant_radii + np.zeros((len(sums), remainder.shape[-1]))
    whole = np.abs(sums.constants) + np.zeros_like(error)
    parts = (sums.places.T, np.abs(sums.factors.T), sums.radii.T)
    for places, factors, radii in zip(*parts, strict=True):
        wide = factors[:, np.newaxis]
        error += wide * remainder[places]
        error += radii[:, np.newaxis] * (size[places] + remainder[places])
        whole += wide * size[places]
    error += (sums.places.shape[1] + 3) * UNIT * whole
    return Models(space, summed(sums, polynomial), rounded_up(error))


def _product(space: Monomials, a: Array, b: Array) -> Array:
    """Multiply polynomials; terms of higher degrees are dropped."""
    first, second, begins = space.pairs
    if len(first) > 1:
        a, b = np.take(a, first, axis=-1), np.take(b, second, axis=-1)
    found = a[0] * b
    for k in range(1, len(a)):
        found[k:] += a[k] * b[: len(a) - k]
    if len(first) == 1:
        return found
    reduced: Array = np.add.reduceat(found, begins, axis=-1)
    return reduced


def _total(terms: Array) -> Any:
    """Return the sum over the first axis, in an order that does not depend on the others."""
    return np.cumsum(terms, axis=0)[-1] if len(terms) else 0.0


def _quotient(above: Array, below: Array) -> Array:
    """Return an upper bound on a quotient; infinite where `below` may not be positive."""
    least = np.nextafter(below, -np.inf)
    found: Array = np.where(least > 0.0, rounded_up(above / least), np.inf)
    return found


def _factors(kinds: list[str], c: Array) -> tuple[Array, Array]:
    """Return the factors of even and odd at c, each within `UNIT` of its size, or of 1."""
    by_even, by_odd = np.empty_like(c), np.empty_like(c)
    for k, kind in enumerate(kinds):
        if kind == EXPONENTIAL:
            by_even[k] = by_odd[k] = _at(c[k], "exp")
        else:
            sine, cosine = _at(c[k], "sin"), _at(c[k], "cos")
            by_even[k], by_odd[k] = (sine, cosine) if kind == SINE else (cosine, -sine)
    return by_even, by_odd


def _at(c: Array, name: str) -> Array:
    """Return a function of doubles, rounded once; NaN where they are not finite."""
    from flint import arb  # imported late: most runs need no balls

    with proof_precision():
        values = [float(getattr(arb(x), name)()) for x in c.tolist()]
    return np.array(values)
