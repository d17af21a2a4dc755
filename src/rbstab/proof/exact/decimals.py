"""The exact number that a double means: of a config its shortest decimal, of code a fraction."""

from fractions import Fraction

import numpy as np

MOST_DENOMINATOR = 1000
"""A double of code that is the nearest one to such a fraction means it."""

WHOLE = 2.0**53
"""From here on all doubles are whole numbers, and mean their shortest decimals."""


def meant(value: object) -> Fraction:
    """Return the number that a double of code means: 0.4 is 2/5, and what 1/3 gives is 1/3."""
    decimal = as_decimal(value)
    if not isinstance(value, (float, np.floating)) or abs(float(value)) >= WHOLE:
        return decimal
    simple = Fraction(float(value)).limit_denominator(MOST_DENOMINATOR)
    return simple if float(simple) == float(value) else decimal


def as_decimal(value: object) -> Fraction:
    """Return the number that a double of a config means, its shortest decimal: 0.4 is 2/5.

    Raises:
        TypeError: It is no number.
    """
    if isinstance(value, Fraction):
        return value
    if isinstance(value, (bool, int, np.integer)):
        return Fraction(int(value))
    if isinstance(value, (float, np.floating)):
        return Fraction(repr(float(value)))
    raise TypeError(f"an expression takes no {type(value).__name__}")
