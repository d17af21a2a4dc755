"""Taylor series in τ of all nodes of a program, in plain double precision.

They begin polynomials near motions. What these miss is bounded afterwards, so the rounding errors
here need no bounds.
"""

from collections.abc import Callable

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.motion.graph import (
    COSINE,
    EXPONENTIAL,
    INVERSE,
    INVERSE_TANGENT,
    LOGARITHM,
    PRODUCT,
    ROOT,
    SINE,
)
from rbstab.proof.motion.monomials import Monomials
from rbstab.proof.motion.program import Operation, Program, Sums

_OF_DOUBLES: dict[str, Callable[[Array], Array]] = {
    INVERSE: np.reciprocal,
    SINE: np.sin,
    COSINE: np.cos,
    EXPONENTIAL: np.exp,
    ROOT: np.sqrt,
    LOGARITHM: np.log,
    INVERSE_TANGENT: np.arctan,
}


def node_series(
    program: Program, space: Monomials, known: Array, longest: Array | None = None, order: int = 0
) -> Array:
    """Return the coefficients of all nodes, shape (order + 1, nodes, sets, monomials).

    Args:
        program: The program. With `longest`, its first results are the rates of the variables.
        space: The monomials in z.
        known: Coefficients of the variables, shape (terms, variables, sets, monomials).
        longest: If given, only the first coefficients of the variables are known, and the others
            follow from the rates: these are motions, τ = t/longest, in s, shape (sets,).
        order: The highest power of τ; without `longest` that of `known`.
    """
    terms = len(known) if longest is None else order + 1
    values = np.zeros((terms, len(program), *known.shape[2:]))
    values[: len(known), : program.variables] = known
    series = [_Series(one, values, space) for one in program.operations]
    rates = program.results[: program.variables]
    with np.errstate(all="ignore"):
        for _ in range(space.degree + 1):  # each time, one more degree in z is right
            for one in series:
                one.begin()
        for k in range(terms):
            if k > 0:
                for one in series:
                    one.go_on(k)
            if longest is not None and k < order:
                rate = summed(rates, values[k], k)
                values[k + 1, : program.variables] = longest[:, np.newaxis] * rate / (k + 1)
    return values


def summed(sums: Sums, values: Array, power: int = 0) -> Array:
    """Return sums of nodes, rounded; the order of the operations is the same for many sets.

    Args:
        sums: The sums.
        values: Coefficients of the nodes, shape (..., nodes, sets, monomials): those of one power
            of τ, or of all from τ⁰ on.
        power: The power of τ of the first ones; a constant belongs to τ⁰.
    """
    total = np.zeros((*values.shape[:-3], len(sums), *values.shape[-2:]))
    if power == 0:
        total[(0,) * (total.ndim - 3)][..., 0] = sums.constants
    for places, factors in zip(sums.places.T, sums.factors.T, strict=True):
        total += factors[:, np.newaxis, np.newaxis] * values[..., places, :, :]
    return total


class _Series:
    """The series of the nodes of one operation, filled order by order."""

    def __init__(self, operation: Operation, values: Array, space: Monomials) -> None:
        self.operation, self.values, self.space = operation, values, space
        self.found = values[:, operation.nodes]
        needed = (*operation.operands, operation.slopes)[:2]
        self.sums = [one for one in needed if one is not None]
        self.first, self.second = (np.zeros_like(self.found) for _ in range(2))

    def _fill(self, k: int, which: int) -> None:
        into = (self.first, self.second)[which]
        into[k] = summed(self.sums[which], self.values[k], k)

    def begin(self) -> None:
        """Compute the coefficients of τ⁰ once more."""
        self._fill(0, 0)
        self._fill(0, 1)
        if self.operation.kind == PRODUCT:
            self.found[0] = _product(self.space, self.first[:1], self.second[:1])
            return
        # By degree in z: the slope of y in a direction is φ' times that of x.
        rates = self.first[:1] * self.space.degrees
        self.found[0] = _product(self.space, rates, self.second[:1])
        self.found[0, ..., 1:] /= self.space.degrees[1:]
        self.found[0, ..., 0] = _OF_DOUBLES[self.operation.kind](self.first[0, ..., 0])

    def go_on(self, k: int) -> None:
        """Compute the coefficients of τᵏ from those of the lower powers."""
        self._fill(k, 0)
        if self.operation.kind == PRODUCT:
            self._fill(k, 1)
            self.found[k] = _product(self.space, self.first[: k + 1], self.second[: k + 1])
            return
        self._fill(k - 1, 1)  # a slope may need nodes of later operations
        rates = self.first[1 : k + 1] * np.arange(1, k + 1)[:, np.newaxis, np.newaxis, np.newaxis]
        self.found[k] = _product(self.space, rates, self.second[:k]) / k


def _product(space: Monomials, a: Array, b: Array) -> Array:
    """Return the coefficient of the highest power of τ in a product."""
    first, second, begins = space.pairs
    if len(first) == 1:
        found: Array = np.cumsum(a * b[::-1], axis=0)[-1]  # in order, for any number of sets
        return found
    products = (np.take(a, first, axis=-1) * np.take(b[::-1], second, axis=-1)).sum(axis=0)
    reduced: Array = np.add.reduceat(products, begins, axis=-1)
    return reduced
