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


def is_convex(operations: Sequence[Sequence[Any]]) -> bool:
    """Return whether the result of operations is shown to be convex in X."""
    found = list[Known]()
    for kind, *operands in operations:
        if kind == "length":
            found.append(Known(0))
        elif kind == "theta":
            found.append(Known(0, fixed=True))
        elif kind == "constant":
            sign = (operands[0] > 0) - (operands[0] < 0)
            # A fixed number 0 has both signs.
            found.append(Known(0, sign or 1, fixed=True, squared_length=sign >= 0))
        elif kind == "**":
            found.append(_power(found[operands[0]], operands[1]))
        elif len(operands) == 1:
            one = found[operands[0]]
            found.append(_scaled(one, -1) if kind == "neg" else _function(kind, one))
        elif kind == "*" and operands[0] == operands[1]:
            found.append(_power(found[operands[0]], 2))
        else:
            found.append(_both(kind, found[operands[0]], found[operands[1]]))
    return found[-1].bend in {0, 1}


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
    return Known(bend, one.sign * sign, one.fixed, one.squared_length and sign > 0)


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
