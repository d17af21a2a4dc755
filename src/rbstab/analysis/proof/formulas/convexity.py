"""Formulas of Θ and X that are convex in X, by their form, for each Θ.

The rules are those of disciplined convex programming (Grant, Boyd and Ye, 2006): each operation
keeps what is known of its operands. A function is *affine* if it is both convex and concave.

Products of affine functions are kept apart, as a quadratic form: x'Kx has terms of either sign, and
is convex if K is positive semidefinite, which is found in exact numbers.
"""

from collections.abc import Mapping
from fractions import Fraction
from itertools import count
from types import MappingProxyType
from typing import Any, NamedTuple

from rbstab.analysis.proof.formulas.program import SQUARE_ABOVE, THETA, Program, computed
from rbstab.analysis.proof.formulas.quadratic_forms import Form, added, is_semidefinite, scaled
from rbstab.analysis.proof.formulas.terms import meant
from rbstab.integrate.straight_line.number import (
    ADD,
    CONSTANT,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
)

NO_FORM: Form = MappingProxyType({})

MOST_PARTS = 40
"""A sum of more affine functions is one of its own: forms have the square of this number."""

MOST_FUNCTIONS = 60
"""Of a form in which more functions are multiplied by others nothing is shown: it takes long."""

MOST_ENTRIES = 2000
"""Further products are not collected with so many others."""

MOST_DIGITS = 200
"""A number with more binary digits is not followed."""


class Shape(NamedTuple):
    """What is known of a result as a function of X: of a quadratic form, plus all else.

    Attributes:
        constant: It does not depend on X.
        convex: All else is convex.
        concave: All else is concave.
        above: It is never negative.
        below: It is never positive.
        squares: It is a sum of squares of affine functions, and perhaps a constant above 0: the
            square of a length.
        root: The mark of the result of which it is a multiple; each result has one.
        rising_with_root: Whether that multiple is by a number of at least 0, or else of at most 0.
        number: The number that it is, if it is known.
        parts: The numbers c with which it is Σ c_a a plus what does not depend on X, by the marks
            of affine functions a; None if it is not known to be such a sum.
        form: The entries m_ab of the quadratic form Σ m_ab a b, with both orders in one of them.
    """

    constant: bool = False
    convex: bool = False
    concave: bool = False
    above: bool = False
    below: bool = False
    squares: bool = False
    root: int | None = None
    rising_with_root: bool = True
    number: Fraction | None = None
    parts: Mapping[int, Fraction] | None = None
    form: Form = NO_FORM

    @property
    def affine(self) -> bool:
        """Whether it is affine."""
        return self.convex and self.concave and not self.form

    @property
    def rising(self) -> bool:
        """Whether a function that rises above 0 of it is convex."""
        return self.convex and self.above

    @property
    def settled(self) -> "Shape":
        """The same without a form: it counts as part of all else."""
        if not self.form:
            return self
        mixed = {mark for pair in self.form for mark in pair if pair[0] != pair[1]}
        if len(mixed) > MOST_FUNCTIONS:
            return self._replace(convex=False, concave=False, form=NO_FORM)
        convex = self.convex and is_semidefinite(self.form)
        concave = self.concave and is_semidefinite(scaled(self.form, -1))
        return self._replace(convex=convex, concave=concave, form=NO_FORM)


UNKNOWN = Shape()
NOT_NEGATIVE = Shape(above=True)
CONVEX_ABOVE = Shape(convex=True, above=True)


def is_convex(program: Program) -> bool:
    """Return whether a formula is shown to be convex in X, wherever it has a value."""
    marks = count()

    def marked(x: Shape) -> Shape:
        """Return a result with a mark of its own, if it is no multiple of another one."""
        mark = next(marks)
        found = x if x.root is not None else x._replace(root=mark)
        unknown = x.affine and (x.parts is None or len(x.parts) > MOST_PARTS)
        return found._replace(parts={mark: Fraction(1)}) if unknown else found

    def leaf(operation: tuple[str, float]) -> Shape:
        kind, number = operation
        if kind == CONSTANT:
            return marked(_number(meant(number)))
        return marked(_constant() if kind == THETA else Shape(convex=True, concave=True))

    def combine(*operation: Any) -> Shape:
        return marked(_combined(*operation))

    return computed(program, leaf, combine)[-1].settled.convex


def _constant(*, above: bool = False, below: bool = False) -> Shape:
    return Shape(
        constant=True, convex=True, concave=True, above=above, below=below, squares=above, parts={}
    )


def _number(number: Fraction) -> Shape:
    # The number 0 has both signs; it counts as one above 0, as the checker has it.
    found = _constant(above=number >= 0, below=number < 0)
    digits = max(abs(number.numerator), number.denominator).bit_length()
    return found._replace(number=number) if digits <= MOST_DIGITS else found


def _combined(kind: str, x: Shape, *others: Any) -> Shape:
    """Return what is known of the result of an operation."""
    if not others:
        return _negated(x) if kind == NEGATE else _function(kind, x.settled)
    (y,) = others
    if kind == POWER:
        return _power(x.settled, y)
    if kind == ADD:
        return _sum(x, y)
    if kind == SUBTRACT:
        return _sum(x, _negated(y))
    if kind == MULTIPLY:
        return _product(x, y)
    return _product(x, _inverse(y)) if y.constant else UNKNOWN


def _sum(x: Shape, y: Shape) -> Shape:
    found = Shape(
        constant=x.constant and y.constant,
        convex=x.convex and y.convex,
        concave=x.concave and y.concave,
        above=x.above and y.above,
        below=x.below and y.below,
        squares=x.squares and y.squares,
        form=added(x.form, y.form),
    )
    if x.parts is not None and y.parts is not None:
        found = found._replace(parts=added(x.parts, y.parts))
    if len(found.form) > MOST_ENTRIES:
        found = found.settled
    if x.number is None or y.number is None:
        return found
    return _number(x.number + y.number)


def _inverse(y: Shape) -> Shape:
    """Return what is known of 1/y for a y that does not depend on X: it has the sign of y."""
    return _number(1 / y.number) if y.number else y._replace(number=None, root=None)


def _negated(x: Shape) -> Shape:
    return _multiple(x, Fraction(-1))


def _multiple(x: Shape, number: Fraction) -> Shape:
    """Return what is known of a number times x."""
    if x.number is not None:
        return _number(number * x.number)
    if number == 0:
        return _number(number)
    parts = None if x.parts is None else scaled(x.parts, number)
    found = x._replace(squares=x.squares and number > 0, parts=parts, form=scaled(x.form, number))
    if number > 0:
        return found
    return found._replace(
        convex=x.concave,
        concave=x.convex,
        above=x.below,
        below=x.above,
        rising_with_root=not x.rising_with_root,
    )


def _square(x: Shape, y: Shape) -> Shape:
    """Return what is known of the product of two multiples of one result."""
    if x.parts and y.parts and x.parts.keys() == y.parts.keys():
        same = x.rising_with_root == y.rising_with_root
        return _of_form(x, y)._replace(above=same, below=not same, squares=same)
    found = _power(x, 2).settled._replace(root=None)
    return found if x.rising_with_root == y.rising_with_root else _negated(found)


def _product(x: Shape, y: Shape) -> Shape:
    """Return what is known of x y."""
    if y.number is not None:
        return _multiple(x, y.number)
    if x.number is not None:
        return _multiple(y, x.number)
    if x.root is not None and x.root == y.root:
        return _square(x.settled, y.settled)
    return _product_of_two(x.settled, y.settled)


def _product_of_two(x: Shape, y: Shape) -> Shape:
    """Return what is known of x y, of two factors that are no multiples of one result."""
    above, below = (x.above and y.above) or (x.below and y.below), _opposite(x, y)
    if x.constant and y.constant:
        return _constant(above=above, below=below)
    if not (x.constant or y.constant):
        found = _of_form(x, y) if x.affine and y.affine else UNKNOWN
        return found._replace(above=above, below=below)
    factor, other = (x, y) if x.constant else (y, x)
    # The factor is no known number, so the product is not known to be a sum.
    other = other._replace(parts=None)
    if factor.above:
        return other._replace(above=above, below=below)
    if factor.below:
        return _negated(other)._replace(above=above, below=below)
    return Shape(convex=other.affine, concave=other.affine)


def _opposite(x: Shape, y: Shape) -> bool:
    return (x.above and y.below) or (x.below and y.above)


def _of_form(x: Shape, y: Shape) -> Shape:
    """Return what is known of the product of two affine functions: a form, and affine terms."""
    found: dict[tuple[int, int], Fraction] = {}
    for one, factor in (x.parts or {}).items():
        for other, another in (y.parts or {}).items():
            pair = (min(one, other), max(one, other))
            # An entry outside of the diagonal stands for both orders.
            share = factor * another / (1 if one == other else 2)
            found[pair] = found.get(pair, Fraction(0)) + share
    return Shape(convex=True, concave=True, form=found)


def _power(x: Shape, exponent: int) -> Shape:
    """Return what is known of xⁿ."""
    even = exponent % 2 == 0
    if x.number is not None and (x.number or exponent >= 0):
        return _number(x.number**exponent)
    if x.constant or exponent == 0:
        return _constant(above=even or x.above, below=not even and x.below)
    if exponent == 1:
        return x
    above = even or x.above
    if exponent == 2 and x.affine:
        return _of_form(x, x)._replace(above=True, squares=True)
    # A power rises on either side of 0; an even one of a function below 0 is that of its opposite.
    if exponent > 0 and ((even and x.affine) or x.rising or (even and _negated(x).rising)):
        return CONVEX_ABOVE
    return Shape(above=above, below=not even and x.below)


def _function(kind: str, x: Shape) -> Shape:
    """Return what is known of a function of one number."""
    above = kind in {"exp", "cosh", "sqrt", SQUARE_ABOVE}
    if x.constant:
        return _constant(above=above)
    if kind in {"exp", SQUARE_ABOVE} and x.convex:
        return CONVEX_ABOVE
    if (kind == "cosh" and (x.affine or x.rising)) or (kind == "sinh" and x.rising):
        return CONVEX_ABOVE
    if kind == "sqrt" and x.squares:
        return CONVEX_ABOVE  # the length of a vector that is affine in X
    if kind in {"sqrt", "log"} and x.concave:
        return Shape(concave=True, above=above)
    return NOT_NEGATIVE if above else UNKNOWN
