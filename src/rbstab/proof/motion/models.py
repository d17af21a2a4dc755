"""Taylor models: polynomials in τ and z with proved bounds on what they miss.

A model stands for a function of τ and z. It differs from the polynomial by at most the remainder
for all real 0 <= τ <= 1 and |z_i| <= 1 (K. Makino and M. Berz, 2003).

Polynomials near all nodes of a program are guessed first, and then proved: each satisfies the
equation of its node, a product or a differential equation, but for a small rest.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.intervals import values_of
from rbstab.proof.exact.atoms import COS, SIN
from rbstab.proof.motion.monomials import Monomials
from rbstab.proof.motion.program import (
    BY_SLOPE,
    INTEGRALS,
    INVERSE,
    PRODUCT,
    ROOT,
    Program,
    Sums,
)
from rbstab.proof.motion.rounding import UNIT, rounded_up
from rbstab.proof.motion.series import node_series, summed


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
    def by_power(self) -> Array:
        """Sums of the absolute coefficients by power of τ, shape (terms, models, sets)."""
        return np.abs(self.polynomial).sum(axis=-1)

    @cached_property
    def by_degree(self) -> Array:
        """The same by degree in z, shape (degree + 1, models, sets)."""
        size = _total(np.abs(self.polynomial))
        return np.moveaxis(np.add.reduceat(size, self.space.first_of_degree, axis=-1), -1, 0)

    @cached_property
    def size(self) -> Array:
        """A bound on the polynomials, shape (models, sets)."""
        bound: Array = rounded_up(_total(self.by_power))
        return bound

    @cached_property
    def spread(self) -> Array:
        """A bound on the polynomials without their constants, shape (models, sets)."""
        varying = self.polynomial.copy()
        varying[0, ..., 0] = 0.0
        return Models(self.space, varying, self.remainder).size

    @cached_property
    def variation(self) -> Array:
        """A bound on the functions without the constants of their polynomials, (models, sets)."""
        total: Array = rounded_up(self.spread + self.remainder)
        return total

    @cached_property
    def bound(self) -> Array:
        """A bound on the functions, shape (models, sets)."""
        total: Array = rounded_up(self.size + self.remainder)
        return total

    def range(self) -> tuple[Array, Array]:
        """Return the least and the largest values, rounded outwards, each (models, sets)."""
        middle = self.polynomial[0, ..., 0]
        middle, apart = np.where(np.isfinite(middle), middle, np.nan), self.variation
        return np.nextafter(middle - apart, -np.inf), np.nextafter(middle + apart, np.inf)


def evaluated(program: Program, variables: Models) -> Models:
    """Return the models of a program's results.

    Args:
        program: The program.
        variables: The models of its variables.
    """
    guess = node_series(program, variables.space, variables.polynomial)
    return Proved(program, variables.space, guess).results(variables.remainder)


class Proved:
    """Polynomials near the nodes of a program, and bounds on what they miss of their equations.

    The equation of a node y with the argument x is y = ab for a product, xy = 1, or y² = x; and for
    other functions, with their slope m, dy = m dx along each ray (sτ, sz), 0 <= s <= 1.

    Args:
        program: The program.
        space: The monomials in z.
        guess: Polynomials near all its nodes, shape (terms, nodes, sets, monomials); those of the
            variables are exact.
    """

    def __init__(self, program: Program, space: Monomials, guess: Array) -> None:
        self.program, self.nodes = program, _exact(space, guess)
        n, y = program.variables, guess
        with np.errstate(all="ignore"):  # a bound that is not finite is none
            pairs = summed(program.operands, y)
            shape = (len(y), 2, len(program) - n, *y.shape[2:])
            first, second = np.moveaxis(pairs.reshape(shape), 1, 0)
            self.first, self.second = _exact(space, first), _exact(space, second)
            self.y = _exact(space, y[:, n:])
            self.missed = rounded_up(self._missed())

    def _missed(self) -> Array:
        """Bound what the equations of all nodes miss, shape (nodes, sets)."""
        program, space, n = self.program, self.nodes.space, self.program.variables
        target = self.y.polynomial.copy()
        left, right = self.first.polynomial.copy(), self.second.polynomial.copy()
        inverses, roots = program.of_kinds(INVERSE) - n, program.of_kinds(ROOT) - n
        right[:, inverses], target[:, inverses] = target[:, inverses], 0.0
        target[0, inverses, :, 0] = 1.0
        left[:, roots] = right[:, roots] = target[:, roots]
        target[:, roots] = self.first.polynomial[:, roots]
        # Along a ray, a term of the degree k in τ and z has the rate k, and its integral is 1/k.
        by_slope = program.of_kinds(*BY_SLOPE) - n
        degrees = np.arange(len(target))[:, np.newaxis] + space.degrees
        degrees = degrees[:, np.newaxis, np.newaxis]
        left[:, by_slope] *= degrees
        target[:, by_slope] *= degrees
        a, b = _exact(space, left), _exact(space, right)
        apart = np.abs(target - _product(space, left, right))
        apart[:, by_slope] /= np.maximum(degrees, 1)
        operations = len(target) + space.most_pairs + 6
        missed = _total(apart.sum(axis=-1))
        missed += operations * UNIT * (a.size * b.size + _exact(space, target).size)
        for of_a, of_b in ((a.by_power, b.by_power), (a.by_degree, b.by_degree)):
            # What has a higher degree: each degree of one factor with the high ones of the other.
            high = np.asarray(_total(of_a[1:] * np.cumsum(of_b[::-1], axis=0)[:-1]) + 0.0 * missed)
            high[by_slope] /= len(of_a)
            missed += high
        for kind in BY_SLOPE:
            k = program.of_kinds(kind) - n
            start = self.y.polynomial[0, k, :, 0]
            exact = values_of(kind, self.first.polynomial[0, k, :, 0])
            missed[k] += np.abs(exact - start) + 4 * UNIT * np.abs(exact)
        # (c + is) exp(-ix) is near 1: what s and c miss counts for both.
        circle = program.of_kinds(SIN, COS) - n
        sums = program.operands
        other = sums.places[sums.begins[len(missed) + circle]] - n
        missed[circle] = missed[circle] + missed[other]
        return missed

    def results(self, apart: Array) -> Models:
        """Return models of the results, for variables within a distance of their polynomials.

        Args:
            apart: Shape (variables, sets).
        """
        program, n = self.program, self.program.variables
        remainder = np.zeros_like(self.nodes.remainder)
        remainder[:n] = apart
        with np.errstate(all="ignore"):
            for operation in program.operations:
                errors = self._error_of(operation.operands, remainder).reshape(
                    2, -1, apart.shape[-1]
                )
                k = slice(operation.nodes.start - n, operation.nodes.stop - n)
                remainder[operation.nodes] = rounded_up(self._error(operation.kind, k, *errors))
            polynomial = summed(program.results, self.nodes.polynomial)
            error = self._error_of(program.results, remainder)
        return Models(self.nodes.space, polynomial, error)

    def _error_of(self, sums: Sums, remainder: Array) -> Array:
        """Bound what sums of polynomials miss, shape (sums, sets)."""
        (factors, radii), (constants, radius) = sums.factors, sums.constants
        rounding = (sums.most + 3) * UNIT
        terms = (np.abs(factors) + radii) * np.take(remainder, sums.places, axis=0)
        terms += (radii + rounding * np.abs(factors)) * np.take(
            self.nodes.size, sums.places, axis=0
        )
        error = np.add.reduceat(terms, sums.begins, axis=0) + radius + rounding * np.abs(constants)
        bound: Array = rounded_up(error)
        return bound

    def _error(self, kind: str, k: slice, ra: Array, rb: Array) -> Any:
        """Bound what some nodes miss whose operands miss at most ra and rb."""
        missed, size = self.missed[k], self.y.size[k]
        x, m = self.first, self.second
        if kind == PRODUCT:
            return missed + x.size[k] * rb + ra * (m.size[k] + rb)
        if kind == INVERSE:  # 1/x - y = -y e/(1 + e) with e = xy - 1
            e = missed + size * ra
            return size * _quotient(e, 1.0 - rounded_up(e))
        if kind == ROOT:  # √x - y = (x - y²)/(√x + y), and x >= y² - e
            e, low = rounded_up(missed + ra), self.y.range()[0][k]
            return np.where((low > 0.0) & (low * low > 1.0001 * e), _quotient(e, low), np.inf)
        if kind in INTEGRALS:  # the slope is within rb of m for all arguments that occur
            return missed + rb * x.spread[k] + (m.size[k] + rb) * ra
        if kind == "exp":  # exp(-x) y changes by what dy - y dx is, times exp(-x); |x' - x| <= ra
            error = missed * _quotient(1.0, 1.0 - x.spread[k] / 16) ** 16
            return error + (size + error) * _quotient(ra, 1.0 - ra)
        return missed + ra


def _exact(space: Monomials, polynomial: Array) -> Models:
    return Models(space, polynomial, np.zeros(polynomial.shape[1:3]))


def _product(space: Monomials, a: Array, b: Array) -> Array:
    """Multiply polynomials; terms of higher degrees are dropped."""
    first, second, begins = space.pairs
    if len(first) > 1:
        a, b = np.take(a, first, axis=-1), np.take(b, second, axis=-1)
    product = a[0] * b
    for k in range(1, len(a)):
        product[k:] += a[k] * b[: len(a) - k]
    if len(first) == 1:
        return product
    reduced: Array = np.add.reduceat(product, begins, axis=-1)
    return reduced


def _total(terms: Array) -> Any:
    """Return the sum over the first axis, in an order that does not depend on the others."""
    return np.cumsum(terms, axis=0)[-1] if len(terms) else 0.0


def _quotient(above: Any, below: Array) -> Array:
    """Return an upper bound on a quotient; infinite where `below` may not be positive."""
    least = np.nextafter(below, -np.inf)
    quotient: Array = np.where(least > 0.0, rounded_up(above / least), np.inf)
    return quotient
