"""Whether a formula is convex in X, for each Θ, by rules for sums, products and compositions.

Of each result it is known whether it is convex (1), concave (-1), or both (0, which is affine), or
neither (None); and whether its sign is 1, -1 or not known (0). A result that does not depend on X
is *fixed*. A sum of squares of affine results, and of fixed ones above 0, is that of a length.

Products of affine results are collected in a matrix (`forms.py`), apart from all else. They are
convex together if it has no eigenvalue below 0.
"""

from collections.abc import Sequence
from fractions import Fraction
from math import isfinite
from typing import Any, NamedTuple

from rbstab.analysis.proof_check.formulas.forms import MOST_ENTRIES, Linear, Matrix, number_meant

MOST_PARTS = 40
"""A sum of more affine results is taken as one of its own."""

MOST_BITS = 200
"""A number that needs more bits is not followed."""


class Known(NamedTuple):
    """What is known of a result: it is a sum of products of affine results, plus all else.

    Attributes:
        bend: That of all else.
        sign: That of the result.
        fixed: Whether it depends on Θ alone.
        squared_length: Whether it is one.
        origin: The place of a result of which it is a multiple, and the sign of the number.
        number: The number that it is, if that is known.
        linear: The affine results of which it is a sum, but for what is fixed; None if unknown.
        matrix: The products of affine results in it.
    """

    bend: int | None
    sign: int = 0
    fixed: bool = False
    squared_length: bool = False
    origin: tuple[int, int] | None = None
    number: Fraction | None = None
    linear: Linear | None = None
    matrix: Matrix = Matrix()

    @property
    def affine(self) -> bool:
        """Whether it is affine."""
        return self.bend == 0 and not self.matrix.entries

    def together(self) -> "Known":
        """Return the same with the products counted among all else."""
        if not self.matrix.entries:
            return self
        sign = self.matrix.sign
        bend = sign if sign and self.bend in {0, sign} else None
        return self._replace(bend=bend, matrix=Matrix())


def is_convex(operations: Sequence[Sequence[Any]]) -> bool:
    """Return whether the result of operations is shown to be convex in X."""
    found = list[Known]()
    for place, operation in enumerate(operations):
        one = _leaf(*operation) or _known(found, *operation)
        if not one.origin:
            one = one._replace(origin=(place, 1))
        if one.affine and (one.linear is None or len(one.linear.parts) > MOST_PARTS):
            one = one._replace(linear=Linear({place: Fraction(1)}))
        found.append(one)
    return found[-1].together().bend in {0, 1}


def _leaf(kind: str, number: Any, *_: int) -> Known | None:
    """Return what is known of a variable or a constant; None of any other operation."""
    if kind == "constant":
        return _of_number(number_meant(number)) if isfinite(number) else _fixed(0)
    if kind == "theta":
        return _fixed(0)
    return Known(0) if kind == "length" else None


def _fixed(sign: int) -> Known:
    return Known(0, sign, fixed=True, squared_length=sign > 0, linear=Linear({}))


def _of_number(number: Fraction) -> Known:
    # The number 0 has both signs; it counts as one above 0.
    found = _fixed(-1 if number < 0 else 1)
    bits = max(number.numerator.bit_length(), number.denominator.bit_length())
    return found._replace(number=number) if bits <= MOST_BITS else found


def _known(found: Sequence[Known], kind: str, *operands: Any) -> Known:
    """Return what is known of the result of one operation."""
    one = found[operands[0]]
    if kind == "**":
        return _power(one.together(), operands[1])
    if kind == "neg":
        return _times_number(one, Fraction(-1))
    if len(operands) == 1:
        return _function(kind, one.together())
    two = found[operands[1]]
    if kind == "-":
        two = _times_number(two, Fraction(-1))
    if kind in {"+", "-"}:
        return _sum(one, two)
    if kind == "/":
        if not two.fixed:
            return Known(None, one.sign * two.sign)
        inverse = None if not two.number else 1 / two.number
        two = two._replace(origin=None, number=inverse)
    return _product(one, two)


def _sum(one: Known, two: Known) -> Known:
    """Return what is known of a sum."""
    if one.number is not None and two.number is not None:
        return _of_number(one.number + two.number)
    linear = None
    if one.linear is not None and two.linear is not None:
        linear = one.linear.plus(two.linear)
    found = Known(
        _common(one.bend, two.bend),
        one.sign if one.sign == two.sign else 0,
        fixed=one.fixed and two.fixed,
        squared_length=one.squared_length and two.squared_length,
        linear=linear,
        matrix=one.matrix.plus(two.matrix),
    )
    return found.together() if len(found.matrix.entries) > MOST_ENTRIES else found


def _common(one: int | None, two: int | None) -> int | None:
    if one is None or two is None or one * two < 0:
        return None
    return one or two


def _product(one: Known, two: Known) -> Known:
    """Return what is known of a product."""
    if one.number is not None:
        return _times_number(two, one.number)
    if two.number is not None:
        return _times_number(one, two.number)
    same = bool(one.origin and two.origin and one.origin[0] == two.origin[0])
    one, two = one.together(), two.together()
    sign = one.sign * two.sign
    if same and one.origin and two.origin:
        return _product_of_multiples(one, two, one.origin[1] * two.origin[1])
    if one.fixed or two.fixed:
        return _times_fixed(two, one) if one.fixed else _times_fixed(one, two)
    if one.affine and two.affine and one.linear and two.linear:
        return Known(0, sign, matrix=one.linear.product(two.linear))
    return Known(None, sign)


def _product_of_multiples(one: Known, two: Known, sign: int) -> Known:
    """Return what is known of the product of two multiples of one result."""
    a, b = one.linear, two.linear
    if one.affine and not one.fixed and a and b and set(a.parts) == set(b.parts):
        return Known(0, sign, squared_length=sign > 0, matrix=a.product(b))
    square = _power(one, 2).together()._replace(origin=None)
    return square if sign > 0 else _times_number(square, Fraction(-1))


def _times_number(one: Known, number: Fraction) -> Known:
    """Return what is known of a number times a result."""
    if one.number is not None:
        return _of_number(one.number * number)
    if number == 0:
        return _of_number(number)
    sign = -1 if number < 0 else 1
    return Known(
        None if one.bend is None else one.bend * sign,
        one.sign * sign,
        fixed=one.fixed,
        squared_length=one.squared_length and sign > 0,
        origin=(one.origin[0], one.origin[1] * sign) if one.origin else None,
        linear=one.linear.times(number) if one.linear else None,
        matrix=one.matrix.times(number),
    )


def _times_fixed(one: Known, fixed: Known) -> Known:
    """Return what is known of a result times a fixed one, which is no known number."""
    sign = one.sign * fixed.sign
    if one.fixed:
        return _fixed(sign)
    if fixed.sign:
        found = _times_number(one, Fraction(fixed.sign))
        return found._replace(linear=None)
    return Known(0 if one.affine else None)


def _power(one: Known, exponent: int) -> Known:
    even = exponent % 2 == 0
    sign = 1 if even else one.sign
    if one.number is not None and (one.number or exponent >= 0):
        return _of_number(one.number**exponent)
    if one.fixed or exponent == 0:
        return _fixed(sign)
    if exponent == 1 or exponent < 0:
        return one if exponent == 1 else Known(None, sign)
    if exponent == 2 and one.affine and one.linear:
        return Known(0, 1, squared_length=True, matrix=one.linear.product(one.linear))
    # It rises with the size of what is raised.
    above = one.sign > 0 and one.bend in {0, 1}
    below = even and one.sign < 0 and one.bend in {0, -1}
    if above or below or (even and one.affine):
        return Known(1, 1)
    return Known(None, sign)


def _function(kind: str, one: Known) -> Known:
    sign = int(kind in {"exp", "cosh", "sqrt", "square_above"})
    if one.fixed:
        return _fixed(sign)
    convex = one.bend in {0, 1}
    above = convex and one.sign > 0
    convex_of = {
        "exp": convex,
        "square_above": convex,
        "cosh": above or one.affine,
        "sinh": above,
        "sqrt": one.squared_length,
    }
    if convex_of.get(kind):
        return Known(1, 1)
    concave = kind in {"sqrt", "log"} and one.bend in {0, -1}
    return Known(-1 if concave else None, sign)
