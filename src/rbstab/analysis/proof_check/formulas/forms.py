"""Sums of affine functions, and their products as the entries of a matrix, in exact numbers."""

from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

from flint import fmpq, fmpq_mat

MOST_DENOMINATOR = 1000

MOST_ENTRIES = 2000
"""Further products are not collected with so many others."""

MOST_FUNCTIONS = 60
"""If more functions are multiplied by others, nothing is shown: it would take long."""


def number_meant(double: float) -> Fraction:
    """Return the number that a double stands for: a simple fraction such as 1/3, or its decimal."""
    simple = Fraction(double).limit_denominator(MOST_DENOMINATOR)
    is_meant = abs(double) < 2.0**53 and float(simple) == double
    return simple if is_meant else Fraction(repr(double))


@dataclass(frozen=True)
class Matrix:
    """The sum of entries m_ab times a b for pairs (a, b) with a <= b, of affine functions.

    Attributes:
        entries: The m_ab, none of which is 0.
    """

    entries: dict[tuple[int, int], Fraction] = field(default_factory=dict)

    @cached_property
    def sign(self) -> int:
        """1 if no eigenvalue is below 0, -1 if none is above 0; 0 if neither is shown."""
        mixed = {place for a, b in self.entries for place in (a, b) if a != b}
        if len(mixed) > MOST_FUNCTIONS:
            return 0
        if no_eigenvalue_below_0(self):
            return 1
        return -1 if no_eigenvalue_below_0(self.times(Fraction(-1))) else 0

    def plus(self, other: "Matrix") -> "Matrix":
        """Return the sum of two."""
        return Matrix(_summed(self.entries, other.entries))

    def times(self, number: Fraction) -> "Matrix":
        """Return a multiple."""
        return Matrix({pair: number * entry for pair, entry in self.entries.items() if number})


@dataclass(frozen=True)
class Linear:
    """A sum of multiples of affine functions, which have numbers.

    Attributes:
        parts: The factors, none of which is 0.
    """

    parts: dict[int, Fraction]

    def plus(self, other: "Linear") -> "Linear":
        """Return the sum of two."""
        return Linear(_summed(self.parts, other.parts))

    def times(self, number: Fraction) -> "Linear":
        """Return a multiple."""
        return Linear({place: number * one for place, one in self.parts.items() if number})

    def product(self, other: "Linear") -> Matrix:
        """Return the products of all parts of two."""
        found = dict[tuple[int, int], Fraction]()
        for a, one in self.parts.items():
            for b, two in other.parts.items():
                found = _summed(found, {(min(a, b), max(a, b)): one * two})
        return Matrix(found)


def _summed(one: dict[Any, Fraction], two: dict[Any, Fraction]) -> dict[Any, Fraction]:
    larger, smaller = (one, two) if len(one) > len(two) else (two, one)
    total = dict(larger)
    for key, value in smaller.items():
        total[key] = total.get(key, Fraction(0)) + value
        if not total[key]:
            del total[key]
    return total


def no_eigenvalue_below_0(matrix: Matrix) -> bool:
    """Return whether a sum of products is never negative, for any values of the functions.

    With the eigenvalues λ_k, the characteristic polynomial is Σ (-1)^k e_k t^(n - k) with the sums
    e_k of all products of k of them. All λ_k are real. None is below 0 exactly if no e_k is: then
    (-1)^n times the polynomial is a sum of terms of one sign for t < 0, and the first is not 0.
    """
    alone = {a for a, _ in matrix.entries} | {b for _, b in matrix.entries}
    alone -= {place for a, b in matrix.entries for place in (a, b) if a != b}
    if any(matrix.entries[a, a] < 0 for a in alone):
        return False
    places = sorted({a for pair in matrix.entries for a in pair} - alone)
    halves = dict[tuple[int, int], fmpq]()
    for (a, b), entry in matrix.entries.items():
        share = fmpq(entry.numerator, entry.denominator)
        halves[a, b] = halves[b, a] = share if a == b else share / 2
    rows = fmpq_mat([[halves.get((a, b), fmpq(0)) for b in places] for a in places])
    coefficients = rows.charpoly().coeffs()
    return all((-1) ** (len(places) - k) * one >= 0 for k, one in enumerate(coefficients))
