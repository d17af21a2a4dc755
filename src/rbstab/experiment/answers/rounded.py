"""Numbers as text; those of proofs are rounded to the side on which the statement stays true."""

import math
from collections.abc import Iterable
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal

NO_VALUE = "-"
"""Shown where there is no value."""

LEVEL_DIGITS = 6
"""Significant digits of an energy."""

TIME_DIGITS = 4
"""Significant digits of a time."""


def number(value: float, digits: int = 4) -> str:
    """Return a number with some significant digits; NaN becomes `NO_VALUE`."""
    return NO_VALUE if math.isnan(value) else f"{value:.{digits}g}"


def vector(values: Iterable[float], digits: int = 4) -> str:
    """Return numbers in parentheses, separated by commas."""
    return f"({', '.join(number(value, digits) for value in values)})"


def rounded_down(number: float | Decimal, digits: int = LEVEL_DIGITS) -> str:
    """Return a number with some significant digits that is not above it: what is below holds."""
    return _rounded(number, digits, ROUND_FLOOR)


def rounded_up(number: float | Decimal, digits: int = TIME_DIGITS) -> str:
    """Return a number with some significant digits that is not below it: what is after holds."""
    return _rounded(number, digits, ROUND_CEILING)


def _rounded(number: float | Decimal, digits: int, rounding: str) -> str:
    rounded = Context(prec=digits, rounding=rounding).plus(Decimal(number))
    return f"{float(rounded):.{digits}g}"
