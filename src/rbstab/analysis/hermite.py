"""Hermite interpolation: polynomials through the values and rates of several samples."""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array


class HermitePolynomials(NamedTuple):
    """Polynomials of degree 2k - 1 in Newton's form, each through k values and k rates.

    Attributes:
        nodes: Each sample time twice, shape (2k, p), s.
        coefficients: The divided differences, 2k arrays of shape (p,).
    """

    nodes: Array
    coefficients: list[Array]

    def values_at(self, t: Array) -> Array:
        """Return the values at times of shape (p,)."""
        value = self.coefficients[-1].copy()
        for node, coefficient in zip(self.nodes[-2::-1], self.coefficients[-2::-1], strict=True):
            value *= t - node
            value += coefficient
        return value

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return the values, first and second derivatives at times of shape (p,)."""
        value = self.coefficients[-1].copy()
        first, second = np.zeros_like(value), np.zeros_like(value)
        for node, coefficient in zip(self.nodes[-2::-1], self.coefficients[-2::-1], strict=True):
            x = t - node
            second = second * x + 2 * first
            first = first * x + value
            value = value * x + coefficient
        return value, first, second


class HermiteTable(NamedTuple):
    """Divided differences of samples: they contain the polynomials through all consecutive ones.

    Attributes:
        nodes: Each sample time twice, shape (2k, p), s.
        differences: The differences of every order j, shape (2k - j, p) each.
    """

    nodes: Array
    differences: list[Array]

    def through(self, first: int, count: int) -> HermitePolynomials:
        """Return the polynomials through `count` consecutive samples."""
        coefficients = [self.differences[order][2 * first] for order in range(2 * count)]
        return HermitePolynomials(self.nodes[2 * first : 2 * (first + count)], coefficients)


def hermite_table(times: Array, values: Array, rates: Array) -> HermiteTable:
    """Return the divided differences of samples.

    Args:
        times: Shape (k, p), s, each column ascending.
        values: Shape (k, p).
        rates: The derivatives of the values, shape (k, p).
    """
    nodes, repeated = np.repeat(times, 2, axis=0), np.repeat(values, 2, axis=0)
    # The difference over a repeated node is the rate.
    first = np.empty_like(repeated[1:])
    first[::2] = rates
    first[1::2] = (values[1:] - values[:-1]) / (times[1:] - times[:-1])
    differences = [repeated, first]
    for order in range(2, len(nodes)):
        lower = differences[-1]
        differences.append((lower[1:] - lower[:-1]) / (nodes[order:] - nodes[:-order]))
    return HermiteTable(nodes, differences)
