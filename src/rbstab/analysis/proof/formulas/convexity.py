"""Formulas of Θ and X that are convex in X, by their form, for each Θ.

The rules are those of disciplined convex programming (Grant, Boyd and Ye, 2006): each operation
keeps what is known of its operands. A function is *affine* if it is both convex and concave.
"""

from typing import Any, NamedTuple

from rbstab.analysis.proof.formulas.program import SQUARE_ABOVE, THETA, Program, computed
from rbstab.integrate.straight_line.number import (
    ADD,
    CONSTANT,
    DIVIDE,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
)


class Shape(NamedTuple):
    """What is known of a result as a function of X.

    Attributes:
        constant: It does not depend on X.
        convex: It is convex.
        concave: It is concave.
        above: It is never negative.
        below: It is never positive.
        squares: It is a sum of squares of affine functions, and perhaps a constant above 0: the
            square of a length.
        root: A mark of the result of which it is a multiple; each result has one.
        rising_with_root: Whether that multiple is by a number of at least 0, or else of at most 0.
    """

    constant: bool = False
    convex: bool = False
    concave: bool = False
    above: bool = False
    below: bool = False
    squares: bool = False
    root: object = None
    rising_with_root: bool = True

    @property
    def affine(self) -> bool:
        """Whether it is affine."""
        return self.convex and self.concave

    @property
    def rising(self) -> bool:
        """Whether a function that rises above 0 of it is convex."""
        return self.convex and self.above


KNOWN = 6
"""The first entries of a shape: what is known by itself."""

UNKNOWN = Shape()
NOT_NEGATIVE = Shape(above=True)
CONVEX_ABOVE = Shape(convex=True, above=True)


def is_convex(program: Program) -> bool:
    """Return whether a formula is shown to be convex in X, wherever it has a value."""

    def leaf(operation: tuple[str, float]) -> Shape:
        kind, number = operation
        if kind == CONSTANT:
            return _marked(_constant(above=number >= 0, below=number <= 0))
        return _marked(_constant() if kind == THETA else Shape(convex=True, concave=True))

    def combine(*operation: Any) -> Shape:
        return _marked(_combined(*operation))

    return computed(program, leaf, combine)[-1].convex


def _marked(x: Shape) -> Shape:
    """Return a result with a mark of its own, if it is no multiple of another one."""
    return x if x.root is not None else x._replace(root=object())


def _constant(*, above: bool = False, below: bool = False) -> Shape:
    return Shape(constant=True, convex=True, concave=True, above=above, below=below, squares=above)


def _combined(kind: str, x: Shape, *others: Any) -> Shape:
    """Return what is known of the result of an operation."""
    if not others:
        return _negated(x) if kind == NEGATE else _function(kind, x)
    (y,) = others
    if kind == POWER:
        return _power(x, y)
    if kind == ADD:
        return _sum(x, y)
    if kind == SUBTRACT:
        return _sum(x, _negated(y))
    if kind == MULTIPLY:
        return _square(x, y) if x.root is y.root else _product(x, y)
    # 1/y has the sign of y.
    return _product(x, y) if kind == DIVIDE and y.constant else UNKNOWN


def _sum(x: Shape, y: Shape) -> Shape:
    both = (bool(one and other) for one, other in zip(x[:KNOWN], y[:KNOWN], strict=True))
    return Shape(*both)


def _negated(x: Shape) -> Shape:
    found = Shape(x.constant, x.concave, x.convex, x.below, x.above)
    return found._replace(root=x.root, rising_with_root=not x.rising_with_root)


def _square(x: Shape, y: Shape) -> Shape:
    """Return what is known of the product of two multiples of one result."""
    found = _power(x, 2)._replace(root=None)
    return found if x.rising_with_root == y.rising_with_root else _negated(found)


def _product(x: Shape, y: Shape) -> Shape:
    """Return what is known of x y, of two factors that are not one and the same."""
    above, below = (x.above and y.above) or (x.below and y.below), _opposite(x, y)
    if x.constant and y.constant:
        return _constant(above=above, below=below)
    if not (x.constant or y.constant):
        return Shape(above=above, below=below)
    factor, other = (x, y) if x.constant else (y, x)
    if factor.above:
        return other._replace(above=above, below=below)
    if factor.below:
        return _negated(other)._replace(above=above, below=below)
    return Shape(convex=other.affine, concave=other.affine)


def _opposite(x: Shape, y: Shape) -> bool:
    return (x.above and y.below) or (x.below and y.above)


def _power(x: Shape, exponent: int) -> Shape:
    """Return what is known of xⁿ."""
    even = exponent % 2 == 0
    if x.constant or exponent == 0:
        return _constant(above=even or x.above, below=not even and x.below)
    if exponent == 1:
        return x
    above = even or x.above
    if exponent > 0 and even and x.affine:
        return CONVEX_ABOVE._replace(squares=exponent == 2)
    # A power rises on either side of 0; an even one of a function below 0 is that of its opposite.
    if exponent > 0 and (x.rising or (even and _negated(x).rising)):
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
