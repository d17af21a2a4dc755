"""Sums Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3) in balls, with t = [1, cos θ, sin θ, cos 2θ, ...]."""

from collections.abc import Sequence
from itertools import combinations_with_replacement, product
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES

Ball = Any

Axes = tuple[int, ...]
"""The axes of a derivative, in rising order."""

ORDERS = {
    axes: tuple(axes.count(axis) for axis in AXES)
    for order in range(4)
    for axes in combinations_with_replacement(AXES, order)
}
"""The order of each derivative along each axis."""


def axes_of(*axes: int) -> Axes:
    """Return axes in rising order."""
    return tuple(sorted(axes))


def rounded(number: float) -> Ball:
    """Return a ball with all real numbers that round to a double."""
    return arb(number, abs(number) * 2.0**-53 + 5e-324)


def misses_zero(ball: Ball) -> bool:
    """Return whether 0 is not in a ball; one without bounds has any number."""
    return bool(ball.is_finite()) and not ball.contains(0)


def square(number: Ball) -> Ball:
    """Return x². python-flint's `x**2` is NaN for a ball about 0."""
    return number * number


def basis(angle: Ball, highest: int) -> list[list[Ball]]:
    """Return the derivatives of t of order 0 to 3, for multiples of an angle up to `highest`."""
    rows = [[arb(int(order == 0))] for order in range(4)]
    for k in range(1, highest + 1):
        sine, cosine = (k * angle).sin_cos()
        turns = [cosine, -sine, -cosine, sine]  # the derivatives of cos; those of sin lag by one
        for order, row in enumerate(rows):
            row += [k**order * turns[order], k**order * turns[order - 1]]
    return rows


class TrigonometricSum:
    """A sum with all its derivatives up to order 3.

    Args:
        coefficients: C, doubles; each stands for all numbers that round to it.
    """

    def __init__(self, coefficients: Sequence[Sequence[Sequence[float]]]) -> None:
        self.layers = [
            arb_mat([[rounded(entry) for entry in row] for row in layer]) for layer in coefficients
        ]

    @property
    def highest(self) -> int:
        """The largest multiple of an angle."""
        return len(self.layers) // 2

    def derivatives(self, Theta: Sequence[Ball]) -> dict[Axes, Ball]:
        """Return the derivatives at a ball of Θ by their axes, in rising order: (0, 0, 2), ..."""
        first, second, third = (arb_mat(basis(angle, self.highest)) for angle in Theta)
        third = third.transpose()
        # All derivatives along axes 2 and 3, one row for each t_a.
        rows = arb_mat([(second * layer * third).entries() for layer in self.layers])
        table = first * rows
        return {axes: table[p, 4 * q + r] for axes, (p, q, r) in ORDERS.items()}

    def steepest(self, axis: int) -> Ball:
        """Bound the derivative along an axis, at any Θ.

        The terms with the same multiples of the angles are a product of the (at most eight)
        coefficients and three unit vectors [cos, sin], so the norm of the coefficients bounds them.
        """
        squares: dict[tuple[int, ...], Ball] = {}
        for a, layer in enumerate(self.layers):
            for b, c in product(range(len(self.layers)), repeat=2):
                multiples = ((a + 1) // 2, (b + 1) // 2, (c + 1) // 2)
                squares[multiples] = squares.get(multiples, arb(0)) + square(layer[b, c])
        return sum((k[axis] * total.abs_upper().sqrt() for k, total in squares.items()), arb(0))
