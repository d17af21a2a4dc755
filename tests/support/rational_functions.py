"""Quotients of polynomials: a kind of number in which identities of the equations are exact."""

import operator

import numpy as np
from flint import Ordering, fmpq, fmpq_mpoly_ctx


class RationalFunction:
    """A quotient of two polynomials with rational coefficients."""

    def __init__(self, numerator, denominator):
        self.numerator, self.denominator = numerator, denominator

    @property
    def is_zero(self):
        """Whether this is the zero function."""
        return self.numerator == 0

    def derivative(self, variable):
        """Return the derivative of a polynomial by a variable, given as a function."""
        assert self.denominator.is_constant()
        (index,) = [k for k, power in enumerate(variable.numerator.degrees()) if power]
        return RationalFunction(self.numerator.derivative(index), self.denominator)

    def _lift(self, other):
        if isinstance(other, RationalFunction):
            return other
        unity = self.denominator.context().constant(1)
        return RationalFunction(unity * fmpq(*float(other).as_integer_ratio()), unity)

    def _combine(self, other, combine):
        if isinstance(other, np.ndarray):
            return NotImplemented  # numpy takes over, entry by entry
        return combine(self, self._lift(other))

    def __add__(self, other):
        return self._combine(other, _sum)

    def __mul__(self, other):
        return self._combine(other, _product)

    def __truediv__(self, other):
        return self._combine(
            other,
            lambda a, b: RationalFunction(a.numerator * b.denominator, a.denominator * b.numerator),
        )

    def __rtruediv__(self, other):
        return NotImplemented if isinstance(other, np.ndarray) else self._lift(other) / self

    def __neg__(self):
        return RationalFunction(-self.numerator, self.denominator)

    def __sub__(self, other):
        return self._combine(other, lambda a, b: a + -b)

    def __rsub__(self, other):
        return -self + other

    __radd__ = __add__
    __rmul__ = __mul__


def _sum(a, b):
    if a.denominator == b.denominator:
        return RationalFunction(a.numerator + b.numerator, a.denominator)
    numerator = a.numerator * b.denominator + b.numerator * a.denominator
    return RationalFunction(numerator, a.denominator * b.denominator)


def _product(a, b):
    return RationalFunction(a.numerator * b.numerator, a.denominator * b.denominator)


class Symbols:
    """Independent variables by name, handed out as arrays."""

    def __init__(self, names):
        self._context = fmpq_mpoly_ctx.get(names, Ordering.lex)
        unity = self._context.constant(1)
        generators = self._context.gens()
        self._free = [RationalFunction(generator, unity) for generator in reversed(generators)]

    def vector(self, size=3):
        """Return new variables, shape (size,)."""
        return np.array([self._free.pop() for _ in range(size)], dtype=object)

    def matrix(self):
        """Return a matrix of nine new variables."""
        return self.vector(9).reshape(3, 3)

    def symmetric(self):
        """Return a symmetric matrix of six new variables."""
        a, b, c, d, e, f = self.vector(6)
        return np.array([[a, b, c], [b, d, e], [c, e, f]], dtype=object)


def variables(count):
    """Return a source of so many independent variables."""
    return Symbols([f"x{k}" for k in range(count)])


def dot(a, b):
    """Return a'b of two vectors."""
    return sum(map(operator.mul, a, b))


class Angle:
    """An angle, known by its sine s and cosine c, which are variables with s² + c² = 1."""

    def __init__(self, symbols):
        self._sine, self._cosine = symbols.vector(2)

    def sin(self):
        """Return the sine."""
        return self._sine

    def cos(self):
        """Return the cosine."""
        return self._cosine

    def derivative(self, function):
        """Return the derivative of a polynomial by this angle."""
        by_sine = function.derivative(self._sine) * self._cosine
        return by_sine - function.derivative(self._cosine) * self._sine

    def reduced(self, numerator):
        """Return what is left of a polynomial when s² is replaced by 1 - c² or c² by 1 - s²."""
        sine, cosine = self._sine.numerator, self._cosine.numerator
        return numerator % (sine * sine + cosine * cosine - 1)


def is_zero_for(angles, function):
    """Return whether a function is zero for all angles.

    The relations s² + c² = 1 of different angles have no variable in common, so the remainder is
    unique: it is zero if and only if the relations make the polynomial zero.
    """
    numerator = function.numerator
    for angle in angles:
        numerator = angle.reduced(numerator)
    return numerator == 0
