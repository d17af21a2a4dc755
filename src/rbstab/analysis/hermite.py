"""Hermite interpolation: polynomials through the values and rates of several samples."""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array


class HermitePolynomials(NamedTuple):
    """Polynomials of degree 2k - 1 in Newton's form, each through k values and k rates.

    Attributes:
        nodes: Each sample time twice, shape (2k, p), s.
        coefficients: The divided differences, shape (2k, p).
    """

    nodes: Array
    coefficients: Array

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


def hermite_polynomials(times: Array, values: Array, rates: Array) -> HermitePolynomials:
    """Return the polynomials through samples.

    Args:
        times: Shape (k, p), s, each column ascending.
        values: Shape (k, p).
        rates: The derivatives of the values, shape (k, p).
    """
    nodes, repeated = np.repeat(times, 2, axis=0), np.repeat(values, 2, axis=0)
    # The difference over a repeated node is the rate.
    differences = np.empty_like(repeated[1:])
    differences[::2] = rates
    differences[1::2] = (values[1:] - values[:-1]) / (times[1:] - times[:-1])
    coefficients = [repeated[0], differences[0]]
    for order in range(2, len(nodes)):
        differences = (differences[1:] - differences[:-1]) / (nodes[order:] - nodes[:-order])
        coefficients.append(differences[0])
    return HermitePolynomials(nodes, np.array(coefficients))
