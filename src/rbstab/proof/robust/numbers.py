"""The bodies in a box, and their numbers as expressions.

A number with a tolerance is p = middle + radius z with |z| <= 1, and z is one more variable of the
traced expressions.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

from rbstab.mechanics.numbers import Array
from rbstab.proof.exact.expr import Expr, expr, variable
from rbstab.systems.system import System

FIRST = 2000
"""The first variable z; those before it are Θ, X and own states."""


class Members(NamedTuple):
    """The functions that build the system of a member.

    Attributes:
        exact: Builds it without elements of users. Its arguments are the numbers that have a
            tolerance, in any kind of number, and the conversion of arrays of all numbers. Such an
            array may contain doubles and numbers that are converted already.
        from_doubles: Builds it with them, from doubles.
    """

    exact: Callable[[Sequence[Any], Callable[[Array], Array]], System]
    from_doubles: Callable[[Sequence[float]], System]


@dataclass(frozen=True)
class Part:
    """A box of bodies: the number p_k is in [middle_k - radius_k, middle_k + radius_k]."""

    middle: tuple[Fraction, ...]
    radius: tuple[Fraction, ...]

    def at(self, z: Sequence[Fraction | int]) -> tuple[Fraction, ...]:
        """Return the numbers p of a body."""
        rows = zip(self.middle, self.radius, z, strict=True)
        return tuple(middle + radius * coordinate for middle, radius, coordinate in rows)

    def halves(self, axis: int) -> "tuple[Part, Part]":
        """Cut the box in two along one number. The halves share a face, so they cover the box."""
        halves = [Fraction(int(k == axis), 2) for k in range(len(self.middle))]
        radius = tuple(r * (1 - half) for r, half in zip(self.radius, halves, strict=True))
        return Part(self.at([-half for half in halves]), radius), Part(self.at(halves), radius)

    def without_width(self) -> "Part":
        """Return the body in the middle, as a box without width."""
        return Part(self.middle, (Fraction(0),) * len(self.middle))

    def expressions(self) -> list[Expr]:
        """Return the numbers p_k = middle_k + radius_k z_k."""
        pairs = zip(self.middle, self.radius, strict=True)
        return [expr(p) + variable(FIRST + k).scaled(r) for k, (p, r) in enumerate(pairs)]
