"""The energy of a barrier on one angle with proved bounds.

The barrier is that of `elements/guards/barrier.py`.

With t = tan θ2 the energy is k P(t), and dt/dθ2 = 1 + t². So each derivative by θ2 is k times a
polynomial in t, by the rule P -> P'(1 + t²). All coefficients are positive, and the powers are all
even or all odd. So each even derivative grows with |θ2|, and each odd one grows with θ2: the bounds
over an interval are the values at its ends. A barrier on θ1 or θ3 has t = tan(θ/2), and each
derivative is half of that.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache

import numpy as np

from rbstab.analysis.exact import fraction_ball, upper
from rbstab.analysis.proof.polynomial import Ring, fraction
from rbstab.elements.guards.barrier import energy_of_tangent
from rbstab.mechanics.numbers import Array

ORDERS = range(4)
"""The orders of the derivatives that are bounded."""

PRECISION = 192
"""Bits of a ball: near ±π/2, tan θ2 of a double keeps more than a hundred of them."""


@dataclass(frozen=True)
class BarrierEnergy:
    """The energy ½ k tan² θ2 of a barrier, or ½ k tan²(θ/2), J, and its derivatives by θ2 or θ.

    Bounds hold for each k that rounds to `stiffness`. They are infinite, or no numbers, where an
    interval reaches an angle at which the energy is infinite: ±π/2, or ±π.

    Args:
        stiffness: k, N m, an exact number rounded once.
        half: Whether the tangent is that of half the angle.
    """

    stiffness: float
    half: bool = False

    @property
    def end(self) -> float:
        """The largest double below the angle at which the energy is infinite, rad."""
        return float(np.pi if self.half else np.pi / 2)

    def approximate(self, angles: Array, order: int) -> list[Array]:
        """Return the derivatives of order 0 to `order` at angles of shape (m,), to round-off."""
        tangent = np.tan(0.5 * angles if self.half else angles)
        return [
            self.stiffness * np.polynomial.polynomial.polyval(tangent, [float(c) for c in row])
            for row in _rows(self.half)[: order + 1]
        ]

    def at(self, angles: Array, order: int) -> tuple[Array, Array]:
        """Return proved bounds on the derivatives of order 0 to `order` at angles of shape (m,).

        Returns:
            Lower and upper bounds, each of shape (order + 1, m).
        """
        different, places = np.unique(angles, return_inverse=True)
        found = [_bounds(self.stiffness, angle, self.half) for angle in different.tolist()]
        table = np.array(found, dtype=float).reshape(-1, len(ORDERS), 2)[places.reshape(-1)]
        return table[:, : order + 1, 0].T, table[:, : order + 1, 1].T

    def over(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Return proved bounds on the derivatives of order 0 to 3 over intervals of θ2.

        Args:
            low: The lower ends, shape (m,), rad.
            high: The upper ends.

        Returns:
            Lower and upper bounds, each of shape (4, m).
        """
        order = ORDERS[-1]
        at_low, at_high = self.at(low, order), self.at(high, order)
        nearest = self.at(np.where(low > 0, low, np.where(high < 0, high, 0.0)), order)
        least, most = at_low[0], at_high[1]
        for even in ORDERS[::2]:
            least[even] = nearest[0][even]
            most[even] = np.maximum(at_low[1][even], at_high[1][even])
        return least, most


@cache
def _rows(half: bool) -> tuple[tuple[Fraction, ...], ...]:
    """Return the coefficients of the derivatives of order 0 to 3 by powers of t, for k = 1."""
    ring = Ring(0, 2)
    stiffness, tangent = ring.variables()
    first = dict[int, Fraction]()
    for powers, value in energy_of_tangent(stiffness, tangent).terms():
        of_stiffness, power = ring.split(powers).lengths
        first[power] = fraction(value)
        if of_stiffness != 1 or power % 2 or not first[power] > 0:
            # The monotonic bounds need this.
            raise ValueError("the energy of a barrier is not k times even powers of tan θ2")
    rows = [[first.get(power, Fraction(0)) for power in range(1 + max(first))]]
    zeros = [Fraction(0)] * 2
    for _ in ORDERS[1:]:
        slope = [n * value for n, value in enumerate(rows[-1])][1:]
        rate = Fraction(1, 2) if half else Fraction(1)
        pairs = zip([*slope, *zeros], [*zeros, *slope], strict=True)
        rows.append([rate * (a + b) for a, b in pairs])
    return tuple(tuple(one) for one in rows)


@lru_cache(maxsize=1 << 16)
def _bounds(
    stiffness: float,
    angle: float,
    half: bool,
) -> tuple[tuple[float, float], ...]:
    """Return bounds on the derivatives of order 0 to 3 at one angle, rounded outwards."""
    from flint import arb, ctx  # imported late, as in `polynomial`

    # The doubles np.pi / 2 and np.pi are below π/2 and π.
    if not abs(angle) <= (np.pi if half else np.pi / 2):
        return ((-math.inf, math.inf),) * len(ORDERS)
    with ctx.workprec(PRECISION):
        k = arb(stiffness, abs(stiffness) * 2.0**-53 + 5e-324)
        share = arb(angle) / 2 if half else arb(angle)
        tangent, found = share.tan(), list[tuple[float, float]]()
        for row in _rows(half):
            value = arb(0)
            for coefficient in reversed(row):
                value = value * tangent + fraction_ball(coefficient)
            value *= k
            found.append((-upper(-value), upper(value)))
    return tuple(found)
