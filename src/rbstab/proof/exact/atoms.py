"""Atoms and their products: what the polynomials of `expr` are made of.

An atom is a variable, or a function of an expression. A monomial is a product of their powers.
"""

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

VAR, SIN, COS, LET, STEP, POSITIVE = "var", "sin", "cos", "let", "step", "positive"
OF = "of"

FUNCTIONS = frozenset({SIN, COS, "sqrt", "exp", "log", "atan"})
"""The kinds of atoms that are smooth functions of one argument."""

INNER = -1
"""The number of the variable of an expression that stands in an atom `OF`."""

Monomial = tuple[tuple["Atom", int], ...]
"""A product of atoms with powers, in the order of the atoms."""


class Atom:
    """A variable (its argument is a number), or a function of an expression.

    Args:
        kind: What it is: `VAR`, `SIN`, `COS`, `LET` (the argument itself), `STEP`, `POSITIVE` (the
            argument where that is positive, else 0), `OF` (an expression of one variable, of the
            argument), or the name of a function.
        argument: Its argument.
        extra: For a step, the order of the first derivative that may jump of the sum in which it
            stands; for `OF`, the expression.
    """

    __slots__ = ("__weakref__", "argument", "extra", "kind", "order", "variables")

    kind: str
    argument: Any
    extra: Any
    order: tuple[int, str]
    variables: frozenset[int]

    def __repr__(self) -> str:
        """Return the atom as a formula."""
        return f"x{self.argument}" if self.kind == VAR else f"{self.kind}({self.argument!r})"

    @property
    def inner(self) -> Any:
        """The argument of a function, an expression."""
        assert not isinstance(self.argument, int)
        return self.argument


def monomial(factors: Iterable[tuple[Atom, int]]) -> Monomial:
    """Return a product of powers of different atoms, in order."""
    return tuple(sorted(((a, p) for a, p in factors if p), key=lambda factor: factor[0].order))


def times(first: Monomial, second: Monomial) -> Monomial:
    """Return the product of two monomials."""
    powers = dict(first)
    for a, p in second:
        powers[a] = powers.get(a, 0) + p
    return monomial(powers.items())


def term_order(term: tuple[Monomial, Fraction]) -> list[tuple[tuple[int, str], int]]:
    """Return the key by which the terms of an expression are sorted."""
    return [(a.order, p) for a, p in term[0]]
