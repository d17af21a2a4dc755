"""Numbers with proved bounds on their errors, many at once: one more kind of number.

A number is a double, or an array of doubles of many members of a sweep, with a bound on its
distance from the exact value. The equations accept such numbers like floats. Balls of python-flint
are tighter, but a ball for each of a million members would take hours.

One operation on doubles has a relative error of at most 2⁻⁵³. `UNIT` is twice that. A bound is
itself computed by at most eight rounded operations from the bounds before it. So after n
operations it can be too small by a factor of at most (1 - 2⁻⁵⁰)ⁿ. `SLACK` makes up for this, up to
n = 10⁹; the energy of a body takes some thousand.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from rbstab.mechanics import numbers
from rbstab.mechanics.numbers import FUNCTIONS, Array, entrywise

UNIT = 2.0**-52
"""Twice the relative error of one operation."""

TINY = 1e-300
"""More than what underflow takes away from the result of one operation, or from its bound."""

STEP = 2.0**-5
"""rad; the steps from angle to angle of the table of sines of many numbers."""

MANY_ANGLES = 500
"""A table of the angles from -π to π has 202 entries, so with fewer numbers it saves no time."""

MAX_ANGLE = 2.0**20
"""rad; the difference of an angle up to here and the nearest one of the table is exact."""

BITS = 80
"""Bits of a ball, so that it is rounded to 53 bits once, at the end."""

SLACK = 1.001
"""A factor on a bound for the roundings in the bound itself."""

Value = Any
"""A float, or an array of shape (m,)."""


class Bounded:
    """A value in doubles, and a bound on its distance from the exact value.

    Args:
        value: The value.
        error: The bound, not negative; infinite or NaN if there is none.
    """

    __slots__ = ("_sine_and_cosine", "error", "value")

    def __init__(self, value: Value, error: Value) -> None:
        self.value = value
        self.error = error
        self._sine_and_cosine: tuple[Bounded, Bounded] | None = None

    @property
    def low(self) -> Value:
        """A lower bound of the exact value."""
        return np.nextafter(self.value - SLACK * self.error, -np.inf)

    @property
    def high(self) -> Value:
        """An upper bound of the exact value."""
        return np.nextafter(self.value + SLACK * self.error, np.inf)

    def __add__(self, other: Any) -> Any:
        if type(other) is not Bounded:
            if isinstance(other, np.ndarray):
                return NotImplemented  # numpy takes over, entry by entry
            return self if other == 0 else self + _exact(other)
        value = self.value + other.value
        return Bounded(value, self.error + other.error + UNIT * abs(value))

    __radd__ = __add__

    def __neg__(self) -> "Bounded":
        return Bounded(-self.value, self.error)

    def __sub__(self, other: Any) -> Any:
        return self + -other

    def __rsub__(self, other: Any) -> Any:
        return -self + other

    def __mul__(self, other: Any) -> Any:
        if type(other) is not Bounded:
            if isinstance(other, np.ndarray):
                return NotImplemented
            if other == 0:
                return 0.0
            return self if other == 1 else self * _exact(other)
        a, b, value = abs(self.value), abs(other.value), self.value * other.value
        error = a * other.error + self.error * (b + other.error) + UNIT * abs(value) + TINY
        return Bounded(value, error)

    __rmul__ = __mul__

    def inverse(self) -> "Bounded":
        """Return 1/x; its error is infinite where x may be zero."""
        size = np.abs(self.value)
        least = size - SLACK * self.error
        with np.errstate(all="ignore"):
            value = np.divide(1.0, self.value)
            error = np.divide(self.error, size * least) + UNIT * np.abs(value) + TINY
        return Bounded(value, np.where(least > 0, error, np.inf))

    def __truediv__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        return self * (other if type(other) is Bounded else _exact(other)).inverse()

    def __rtruediv__(self, other: Any) -> Any:
        return self.inverse() * other

    def __pow__(self, exponent: int) -> Any:
        if isinstance(exponent, np.ndarray) or exponent != int(exponent):
            return NotImplemented
        product: Any = _exact(1.0)
        for _ in range(abs(int(exponent))):
            product = product * self
        return product if exponent >= 0 else product.inverse()

    def sqrt(self) -> "Bounded":
        """Return the square root; its error is infinite where the number may be zero.

        √x - √v = (x - v)/(√x + √v), so the error is at most that of x, divided by √v.
        """
        least = self.value - SLACK * self.error
        with np.errstate(all="ignore"):
            value = np.sqrt(self.value)
            error = np.divide(self.error, value) + UNIT * value + TINY
        return Bounded(value, np.where(least > 0, error, np.inf))

    def sin(self) -> "Bounded":
        """Return the sine."""
        return self._both()[0]

    def cos(self) -> "Bounded":
        """Return the cosine."""
        return self._both()[1]

    def _both(self) -> "tuple[Bounded, Bounded]":
        if self._sine_and_cosine is None:
            sine, cosine = _sine_and_cosine(np.asarray(self.value, dtype=float))
            # They change by at most as much as the angle.
            sine, cosine = (Bounded(f.value, f.error + self.error) for f in (sine, cosine))
            self._sine_and_cosine = sine, cosine
        return self._sine_and_cosine

    def _through(self, name: str) -> "Bounded":
        """Return a function of one number by its name; elements of users may state it."""
        from flint import arb, ctx  # imported late: few sweeps have such elements

        shape = np.broadcast_shapes(np.shape(self.value), np.shape(self.error))
        value, error = (np.broadcast_to(part, shape).ravel() for part in (self.value, self.error))
        pairs, places = np.unique(np.stack([value, SLACK * error]), axis=1, return_inverse=True)
        images = np.full(pairs.shape, np.nan)
        with ctx.workprec(BITS):
            for k, (middle, radius) in enumerate(pairs.T.tolist()):
                if np.isfinite(middle) and np.isfinite(radius):
                    ball = getattr(numbers, name)(arb(middle, radius))
                    images[:, k] = float(ball.mid()), float(ball.rad())
        value, error = images[:, places.ravel()].reshape(2, *shape)
        return Bounded(value, SLACK * error + UNIT * np.abs(value) + TINY)


def _method(name: str) -> Callable[[Bounded], Bounded]:
    return lambda number: number._through(name)


for _name in FUNCTIONS.keys() - {"sin", "cos", "sqrt"}:
    setattr(Bounded, _name, _method(_name))


def _exact(number: Any) -> Bounded:
    """Return a double or an integer as a number without an error."""
    if not isinstance(number, float | int):
        # The error of a number of another kind would be lost.
        raise TypeError(f"a bounded number cannot be combined with {type(number).__name__}")
    return Bounded(float(number), 0.0)


def _sine_and_cosine(angles: Array) -> tuple[Bounded, Bounded]:
    """Return the sines and cosines of doubles."""
    if not (angles.size >= MANY_ANGLES and np.abs(angles).max() <= MAX_ANGLE):
        return _by_flint(angles)
    # python-flint takes 2 µs for an angle. So the angles θ of many members are taken from the
    # nearest angle a of a table: sin(a + δ) = sin a cos δ + cos a sin δ. Here |δ| <= 2⁻⁶, and
    # δ = θ - a is exact: both are multiples of the last bit of θ.
    nearest = np.rint(angles / STEP) * STEP
    sine, cosine = _by_flint(nearest)
    delta = Bounded(angles - nearest, 0.0)
    square = delta * delta
    small_sine = delta * (1 - square / 6 * (1 - square / 20))
    small_cosine = 1 - square / 2 * (1 - square / 12 * (1 - square / 30))
    # The series of sin δ and cos δ end after δ⁵ and δ⁶.
    # What they leave out is at most δ⁷/7! + δ⁸/8! < 2⁻⁵⁴.
    left_out = Bounded(0.0, 2.0**-54)
    return (
        sine * small_cosine + cosine * small_sine + left_out,
        cosine * small_cosine - sine * small_sine + left_out,
    )


def _by_flint(angles: Array) -> tuple[Bounded, Bounded]:
    """Return the sines and cosines of doubles, each rounded once."""
    from flint import arb, ctx  # imported late: few commands need it

    different, places = np.unique(angles, return_inverse=True)
    with ctx.workprec(BITS):
        pairs = [[float(f) for f in arb(angle).sin_cos()] for angle in different.tolist()]
    table = np.array(pairs).reshape(-1, 2)[places.reshape(angles.shape)]
    return Bounded(table[..., 0], UNIT), Bounded(table[..., 1], UNIT)


def bounded_decimals(values: Array) -> Array:
    """Return the numbers that the doubles of a config mean; zeros stay doubles.

    A double means the shortest decimal that reads as the same double, so it is at most half a unit
    of the last place away. Entries that are bounded already stay as they are.
    """

    def bounded(entry: Any) -> Any:
        return entry if type(entry) is Bounded or entry == 0 else bounded_decimal(float(entry))

    return entrywise(bounded, values)


def bounded_decimal(value: Value) -> Bounded:
    """Return the decimal that a double means, or those that an array of doubles means."""
    return Bounded(value, UNIT * np.abs(value) + TINY)
