"""Whether a formula is convex in X, for each Θ, by rules for sums, products and compositions.

Of each result it is known whether it is convex (1), concave (-1), or both (0, which is affine), or
neither (None); and whether its sign is 1, -1 or not known (0). A result that does not depend on X
is *fixed*. A sum of squares of affine results, and of fixed ones above 0, is that of a length.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple


class Known(NamedTuple):
    """What is known of a result."""

    bend: int | None
    sign: int = 0
    fixed: bool = False
    squared_length: bool = False
    origin: tuple[int, int] | None = None
    """The place of a result of which it is a multiple, and the sign of the number."""


def is_convex(operations: Sequence[Sequence[Any]]) -> bool:
    """Return whether the result of operations is shown to be convex in X."""
    found = list[Known]()
    for place, operation in enumerate(operations):
        one = _leaf(*operation) or _known(found, *operation)
        found.append(one if one.origin else one._replace(origin=(place, 1)))
    return found[-1].bend in {0, 1}


def _leaf(kind: str, number: Any, *_: int) -> Known | None:
    """Return what is known of a variable or a constant; None of any other operation."""
    if kind == "constant":
        sign = (number > 0) - (number < 0)
        # A fixed number 0 has both signs.
        return Known(0, sign or 1, fixed=True, squared_length=sign >= 0)
    return Known(0, fixed=kind == "theta") if kind in {"length", "theta"} else None


def _known(found: Sequence[Known], kind: str, *operands: Any) -> Known:
    """Return what is known of the result of one operation."""
    one = found[operands[0]]
    if kind == "**":
        return _power(one, operands[1])
    if len(operands) == 1:
        return _scaled(one, -1) if kind == "neg" else _function(kind, one)
    two = found[operands[1]]
    if kind == "*" and one.origin and two.origin and one.origin[0] == two.origin[0]:
        square = _power(one, 2)._replace(origin=None)
        return square if one.origin[1] == two.origin[1] else _scaled(square, -1)
    return _both(kind, one, two)


def _both(kind: str, one: Known, two: Known) -> Known:
    """Return what is known of a sum, a difference, a product of two results, or a quotient."""
    if kind == "-":
        return _both("+", one, _scaled(two, -1))
    if kind == "+":
        bend = _common(one.bend, two.bend)
        sign = one.sign if one.sign == two.sign else 0
        return Known(bend, sign, one.fixed and two.fixed, one.squared_length and two.squared_length)
    sign = one.sign * two.sign
    if one.fixed and two.fixed:
        return Known(0, sign, fixed=True, squared_length=sign > 0)
    if two.fixed:
        return _times(one, two)
    if one.fixed and kind == "*":
        return _times(two, one)
    return Known(None, sign)


def _common(one: int | None, two: int | None) -> int | None:
    if one is None or two is None or one * two < 0:
        return None
    return one or two


def _times(one: Known, fixed: Known) -> Known:
    """Return what is known of a result times a fixed one, or divided by it."""
    if fixed.sign:
        return _scaled(one, fixed.sign)
    return Known(0 if one.bend == 0 else None)


def _scaled(one: Known, sign: int) -> Known:
    bend = None if one.bend is None else one.bend * sign
    origin = (one.origin[0], one.origin[1] * sign) if one.origin else None
    return Known(bend, one.sign * sign, one.fixed, one.squared_length and sign > 0, origin)


def _power(one: Known, exponent: int) -> Known:
    even = exponent % 2 == 0
    sign = 1 if even else one.sign
    if one.fixed or exponent == 0:
        return Known(0, sign, fixed=True, squared_length=sign > 0)
    if exponent == 1 or exponent < 0:
        return one if exponent == 1 else Known(None, sign)
    if even and one.bend == 0:
        return Known(1, 1, squared_length=exponent == 2)
    # It rises with the size of what is raised.
    above = one.sign > 0 and one.bend in {0, 1}
    below = even and one.sign < 0 and one.bend in {0, -1}
    return Known(1, 1) if above or below else Known(None, sign)


def _function(kind: str, one: Known) -> Known:
    sign = int(kind in {"exp", "cosh", "sqrt", "square_above"})
    if one.fixed:
        return Known(0, sign, fixed=True, squared_length=sign > 0)
    convex = one.bend in {0, 1}
    above = convex and one.sign > 0
    convex_of = {
        "exp": convex,
        "square_above": convex,
        "cosh": above or one.bend == 0,
        "sinh": above,
        "sqrt": one.squared_length,
    }
    if convex_of.get(kind):
        return Known(1, 1)
    concave = kind in {"sqrt", "log"} and one.bend in {0, -1}
    return Known(-1 if concave else None, sign)
