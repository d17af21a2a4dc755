"""A number with first derivatives, over any of python-flint's numbers: one more kind of number.

The value is an `arb` (a ball), an `acb` (a complex ball), or an `arb_series` (a power series in
time). The equations accept duals like floats, so they give derivatives of balls and of series.
Numbers that are not duals are exact doubles; 0.0 and 1.0 among them are not multiplied.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from rbstab.analysis.exact import decimal_balls
from rbstab.mechanics.numbers import Array

Value = Any
Slopes = dict[int, Value]


class Dual:
    """A value and its derivatives by some variables.

    Args:
        value: The value.
        slopes: The derivatives that are not zero, by the numbers of their variables.
    """

    __slots__ = ("_sine_and_cosine", "slopes", "value")

    def __init__(self, value: Value, slopes: Slopes | None = None) -> None:
        self.value = value
        self.slopes: Slopes = slopes or {}
        self._sine_and_cosine: tuple[Dual, Dual] | None = None

    def __add__(self, other: Any) -> Any:
        if type(other) is Dual:
            slopes = _sum(self.slopes, other.slopes) if other.slopes else self.slopes
            return Dual(self.value + other.value, slopes)
        if isinstance(other, np.ndarray):
            return NotImplemented  # numpy takes over, entry by entry
        return self if other == 0 else Dual(self.value + _exact(other), self.slopes)

    __radd__ = __add__

    def __neg__(self) -> "Dual":
        return Dual(-self.value, {index: -slope for index, slope in self.slopes.items()})

    def __sub__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self + -other

    def __rsub__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else -self + other

    def __mul__(self, other: Any) -> Any:
        if type(other) is Dual:
            a, b = self.value, other.value
            if not self.slopes and not other.slopes:
                return Dual(a * b)
            slopes = {index: slope * b for index, slope in self.slopes.items()}
            if other.slopes:
                slopes = _sum(slopes, {index: a * slope for index, slope in other.slopes.items()})
            return Dual(a * b, slopes)
        if isinstance(other, np.ndarray):
            return NotImplemented
        if other == 0:
            return 0.0
        if other == 1:
            return self
        factor = _exact(other)
        return Dual(self.value * factor, {k: slope * factor for k, slope in self.slopes.items()})

    __rmul__ = __mul__

    def inverse(self) -> "Dual":
        """Return 1/x.

        Raises:
            ZeroDivisionError: The value may be zero.
        """
        inverse = 1 / self.value
        return self._through(inverse, lambda: -(inverse * inverse))

    def __truediv__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        divisor = other if type(other) is Dual else Dual(_exact(other))
        return self * divisor.inverse()

    def __rtruediv__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        return self.inverse() * other

    def sin(self) -> "Dual":
        """Return the sine."""
        return self._both()[0]

    def cos(self) -> "Dual":
        """Return the cosine."""
        return self._both()[1]

    def sqrt(self) -> "Dual":
        """Return the square root; it is no number where that may not be smooth.

        A complex ball must not touch the branch cut, as the root is not analytic there.
        """
        root = _root(self.value)
        return self._through(root, lambda: 1 / (2 * root))

    def exp(self) -> "Dual":
        """Return the exponential."""
        value = self.value.exp()
        return self._through(value, lambda: value)

    def log(self) -> "Dual":
        """Return the logarithm; it is no number where that may not be smooth."""
        return self._through(_logarithm(self.value), lambda: 1 / self.value)

    def tan(self) -> "Dual":
        """Return the tangent."""
        sine, cosine = self._both()
        return sine * cosine.inverse()

    def atan(self) -> "Dual":
        """Return the inverse tangent; it is no number where it may not be smooth."""
        square = 1 + self.value * self.value
        value = self.value.atan() + 0 * _root(square)
        return self._through(value, lambda: 1 / square)

    def sinh(self) -> "Dual":
        """Return the hyperbolic sine."""
        up, down = self.exp(), (-self).exp()
        return (up - down) * 0.5

    def cosh(self) -> "Dual":
        """Return the hyperbolic cosine."""
        up, down = self.exp(), (-self).exp()
        return (up + down) * 0.5

    def tanh(self) -> "Dual":
        """Return the hyperbolic tangent."""
        return 1.0 - ((self * 2.0).exp() + 1.0).inverse() * 2.0

    def _through(self, value: Value, slope: Callable[[], Value]) -> "Dual":
        """Return g(x), from g and its slope at x."""
        factor = slope() if self.slopes else None
        return Dual(value, {index: one * factor for index, one in self.slopes.items()})

    def _both(self) -> "tuple[Dual, Dual]":
        if self._sine_and_cosine is None:
            sine, cosine = self.value.sin_cos()
            self._sine_and_cosine = (
                Dual(sine, {index: cosine * slope for index, slope in self.slopes.items()}),
                Dual(cosine, {index: -sine * slope for index, slope in self.slopes.items()}),
            )
        return self._sine_and_cosine


def _root(value: Value) -> Value:
    from flint import acb  # imported late, as in `_exact`

    return value.sqrt(analytic=True) if isinstance(value, acb) else value.sqrt()


def _logarithm(value: Value) -> Value:
    from flint import acb

    return value.log(analytic=True) if isinstance(value, acb) else value.log()


def _sum(first: Slopes, second: Slopes) -> Slopes:
    found = dict(first)
    for index, slope in second.items():
        found[index] = found[index] + slope if index in found else slope
    return found


def _exact(number: Any) -> Value:
    """Return a double or an integer as an exact ball.

    Raises:
        TypeError: It is a number of another kind, whose error would be lost.
    """
    from flint import arb  # imported late: most runs need no balls

    if not isinstance(number, float | int):
        raise TypeError(f"a dual cannot be combined with {type(number).__name__}")
    return arb(number)


def decimal_duals(values: Array) -> Array:
    """Return each number of a config as a dual without derivatives; zeros stay doubles.

    The value is a ball of the current precision, around the decimal that the double means (see
    `decimal_balls`).
    """
    balls = decimal_balls(values).ravel().tolist()
    return objects([Dual(ball) if ball != 0 else 0.0 for ball in balls]).reshape(values.shape)


def objects(entries: list[Any]) -> Array:
    """Return a list of numbers as an object array; numpy would take a series for a sequence."""
    found = np.empty(len(entries), dtype=object)
    for index, entry in enumerate(entries):
        found[index] = entry
    return found
