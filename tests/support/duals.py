"""Dual numbers of second order: values that carry their gradient and Hessian."""

import operator

import numpy as np
from flint import arb


class Dual:
    """A value with its gradient, shape (n,), and its Hessian, shape (n, n), as object arrays."""

    def __init__(self, value, gradient, hessian):
        self.value, self.gradient, self.hessian = value, gradient, hessian

    def __add__(self, other):
        if not isinstance(other, Dual):
            return Dual(self.value + other, self.gradient, self.hessian)
        return Dual(*map(operator.add, self._parts(), other._parts()))

    def __mul__(self, other):
        if not isinstance(other, Dual):
            return Dual(*(part * other for part in self._parts()))
        cross = np.outer(self.gradient, other.gradient)
        return Dual(
            self.value * other.value,
            self.value * other.gradient + other.value * self.gradient,
            self.value * other.hessian + other.value * self.hessian + cross + cross.T,
        )

    def _parts(self):
        return self.value, self.gradient, self.hessian

    def _through(self, value, slope, bend):
        outer = np.outer(self.gradient, self.gradient)
        return Dual(value, slope * self.gradient, slope * self.hessian + bend * outer)

    def sin(self):
        sine, cosine = self.value.sin(), self.value.cos()
        return self._through(sine, cosine, -sine)

    def cos(self):
        sine, cosine = self.value.sin(), self.value.cos()
        return self._through(cosine, -sine, -cosine)

    def __truediv__(self, other):
        if not isinstance(other, Dual):
            return self * (1 / other)
        inverse = 1 / other.value
        return self * other._through(inverse, -inverse * inverse, 2 * inverse**3)

    def __rtruediv__(self, other):
        return Dual(other, 0 * self.gradient, 0 * self.hessian) / self

    def __neg__(self):
        return self * -1

    def __sub__(self, other):
        return self + -other

    def __rsub__(self, other):
        return -self + other

    __radd__ = __add__
    __rmul__ = __mul__


def arbs(numbers):
    """Return an array of doubles as exact intervals of radius 0."""
    flat = [arb(number) for number in np.ravel(numbers).tolist()]
    return np.array([*flat, None], dtype=object)[:-1].reshape(np.shape(numbers))


def variables(values):
    """Return the duals of independent variables."""
    one = arbs(np.eye(len(values)))
    zero = arbs(np.zeros((len(values), len(values))))
    return np.array([Dual(x, one[i], zero) for i, x in enumerate(values)], dtype=object)
