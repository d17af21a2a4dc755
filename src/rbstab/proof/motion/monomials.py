"""Polynomials in z of bounded degree, for |z_i| <= 1: their products."""

from dataclasses import dataclass
from functools import cache, cached_property
from math import comb

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.compiled import exponents


@dataclass(frozen=True)
class Monomials:
    """The monomials of some variables up to a degree; lower degrees come first.

    A polynomial is an array with one row of coefficients for each monomial.

    Args:
        variables: The number of variables.
        degree: The highest degree; 0 for polynomials that do not depend on z.
    """

    variables: int
    degree: int

    @cached_property
    def exponents(self) -> tuple[tuple[int, ...], ...]:
        """The exponents of each monomial; those of a lower degree are the first ones."""
        return tuple(exponents(self.variables, self.degree)[0])

    @cached_property
    def place(self) -> dict[tuple[int, ...], int]:
        """The place of each monomial."""
        return exponents(self.variables, self.degree)[1]

    @cached_property
    def degrees(self) -> Array:
        """The degree of each monomial."""
        return np.array([sum(powers) for powers in self.exponents])

    @cached_property
    def first_of_degree(self) -> Array:
        """The place of the first monomial of each degree."""
        return np.searchsorted(self.degrees, np.arange(self.degree + 1))

    def __len__(self) -> int:
        return comb(self.variables + self.degree, self.degree)

    @cached_property
    def pairs(self) -> tuple[Array, Array, Array]:
        """All pairs of monomials whose product is kept, ordered by the product.

        Returns:
            The places of the first factors and of the second ones, and where the pairs of each
            product begin.
        """
        rows = []
        for i, first in enumerate(self.exponents):
            for j, second in enumerate(self.exponents):
                total = tuple(a + b for a, b in zip(first, second, strict=True))
                if sum(total) <= self.degree:
                    rows.append((self.place[total], i, j))
        table = np.array(sorted(rows))
        begins = np.searchsorted(table[:, 0], np.arange(len(self)))
        return table[:, 1], table[:, 2], begins

    @cached_property
    def most_pairs(self) -> int:
        """The largest number of pairs with the same product."""
        ends = np.append(self.pairs[2], len(self.pairs[0]))
        return int(np.diff(ends).max())


@cache
def monomials_up_to(variables: int, degree: int) -> Monomials:
    """Return monomials whose pairs are found only once."""
    return Monomials(variables, degree)
