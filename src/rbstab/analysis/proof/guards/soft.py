"""The energy of a soft guard on θ2 with proved bounds; a stop is one with an infinite couple.

With the excess e = (|θ2| - θ_s)₊ the energy is K e + ½ k e². It is convex. Its slope has the sign
of θ2 and the size K + k e where e > 0. At |θ2| = θ_s the slope jumps by K, and a body may rest
there under any couple between (Filippov). A stop allows no e > 0, and any couple at e = 0.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.proof.polynomial import Ring, exact_number, fraction
from rbstab.elements.guards.soft_guards import SoftGuard
from rbstab.mechanics.numbers import Array

MARGIN = 4 * 2.0**-52
"""More than the relative errors of θ_s, k and K, each rounded once, and of some operations."""


class Between(NamedTuple):
    """Bounds on an energy and its derivatives by θ2, from low to high, shape (m,) each.

    Attributes:
        value: The energy at the centres of boxes, J.
        slope: What the slope at the centre may be, and over all of the box where it jumps in it.
        curvature: The second derivative over the box, without its infinite value at a jump.
        jumps: Whether the slope may jump in the box, or at an end of it, shape (m,).
    """

    value: tuple[Array, Array]
    slope: tuple[Array, Array]
    curvature: tuple[Array, Array]
    jumps: Array


@dataclass(frozen=True)
class SoftEnergy:
    """The energy K e + ½ k e², J, with e = (|θ2| - θ_s)₊; each number is exact and rounded once.

    Args:
        couple: K, N m; infinite for a stop.
        stiffness: k, N m/rad.
        angle: θ_s, rad.
    """

    couple: float
    stiffness: float
    angle: float

    @property
    def inner(self) -> float:
        """A double that is not above θ_s."""
        return self.angle * (1 - MARGIN)

    @property
    def outer(self) -> float:
        """A double that is not below θ_s."""
        return self.angle * (1 + MARGIN)

    @property
    def is_stop(self) -> bool:
        """Whether θ2 cannot get beyond θ_s."""
        return math.isinf(self.couple)

    def approximate(self, angles: Array, order: int) -> list[Array]:
        """Return the derivatives of order 0 to `order` at angles, to round-off; a stop has none."""
        excess, side = np.maximum(np.abs(angles) - self.angle, 0.0), np.sign(angles)
        beyond = (excess > 0).astype(float)
        couple = 0.0 if self.is_stop else self.couple
        found = [
            excess * (couple + 0.5 * self.stiffness * excess),
            side * beyond * (couple + self.stiffness * excess),
            beyond * self.stiffness,
            0.0 * excess,
        ]
        return found[: order + 1]

    def at(self, angles: Array, order: int) -> tuple[Array, Array]:
        """Return proved bounds on the derivatives of order 0 to `order` at angles of shape (m,).

        Returns:
            Lower and upper bounds, each of shape (order + 1, m); infinite where there are none.
        """
        low, high = self.over(angles, angles)
        return low[: order + 1], high[: order + 1]

    def over(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Return proved bounds on the derivatives of order 0 to 3 over intervals of θ2.

        Those of order 2 are infinite where the slope jumps, and those of order 3 where the second
        derivative does.
        """
        nearest = np.where(low > 0, low, np.where(high < 0, -high, 0.0))
        farthest = np.maximum(np.abs(low), np.abs(high))
        energy = self._energy(nearest)[0], self._energy(farthest)[1]
        slope = self._slope(low)[0], self._slope(high)[1]
        bent = self._curvature(nearest)[0], self._curvature(farthest)[1]
        jumps = self.jumps(low, high)
        kink = np.where(jumps, np.inf, 0.0)
        curvature = bent[0], bent[1] + (kink if self.couple > 0 else 0.0)
        return (
            np.stack([energy[0], slope[0], curvature[0], -kink]),
            np.stack([energy[1], slope[1], curvature[1], kink]),
        )

    def jumps(self, low: Array, high: Array) -> Array:
        """Return whether ±θ_s may be in each interval of θ2, shape (m,)."""
        above = (low <= self.outer) & (high >= self.inner)
        below = (low <= -self.inner) & (high >= -self.outer)
        found: Array = above | below
        return found

    def between(self, low: Array, high: Array, centre: Array) -> Between:
        """Return the bounds from which U over boxes follows, expanded about their centres."""
        nearest = np.where(low > 0, low, np.where(high < 0, -high, 0.0))
        farthest = np.maximum(np.abs(low), np.abs(high))
        jumps = self.jumps(low, high) & (self.couple > 0)
        slopes = [self._slope(angles) for angles in (low, centre, high)]
        size = np.abs(centre)
        return Between(
            self._energy(size),
            (
                np.where(jumps, slopes[0][0], slopes[1][0]),
                np.where(jumps, slopes[2][1], slopes[1][1]),
            ),
            (self._curvature(nearest)[0], self._curvature(farthest)[1]),
            jumps,
        )

    def _excess(self, size: Array) -> tuple[Array, Array]:
        """Return bounds on e at some |θ2|."""
        return np.maximum(size - self.outer, 0.0), np.maximum(size - self.inner, 0.0)

    def _energy(self, size: Array) -> tuple[Array, Array]:
        """Return bounds on the energy at some |θ2|; that of a stop is 0, also where it is none."""
        couple = 0.0 if self.is_stop else self.couple
        low, high = (e * (couple + 0.5 * self.stiffness * e) for e in self._excess(size))
        return low * (1 - MARGIN), high * (1 + MARGIN)

    def _slope(self, angle: Array) -> tuple[Array, Array]:
        """Return bounds on the slope at some θ2."""
        size = np.abs(angle)
        low, high = self._excess(size)
        least = np.where(size > self.outer, self.couple + self.stiffness * low, 0.0)
        most = np.where(size >= self.inner, self.couple + self.stiffness * high, 0.0)
        least, most = least * (1 - MARGIN), most * (1 + MARGIN)
        return np.where(angle > 0, least, -most), np.where(angle > 0, most, -least)

    def _curvature(self, size: Array) -> tuple[Array, Array]:
        """Return bounds on the second derivative at some |θ2|, without its infinite value."""
        low = np.where(size > self.outer, self.stiffness * (1 - MARGIN), 0.0)
        return low, np.where(size >= self.inner, self.stiffness * (1 + MARGIN), 0.0)


def soft_energies(guards: Sequence[SoftGuard]) -> tuple[SoftEnergy, ...]:
    """Return the energies that soft guards state, whose parameters are exact numbers.

    Those with the same angle are added up. The result is in the order of the angles.

    Raises:
        ValueError: One states another energy than that of this module.
    """
    sums = dict[Fraction, tuple[Fraction, Fraction]]()
    for guard in guards:
        couple, stiffness, angle = _exact(guard)
        known = sums.get(angle, (Fraction(0), Fraction(0)))
        sums[angle] = known[0] + couple, known[1] + stiffness
    return tuple(
        SoftEnergy(float(couple), float(stiffness), float(angle))
        for angle, (couple, stiffness) in sorted(sums.items())
        if couple > 0 or stiffness > 0
    )


def stop_energy(angle: Fraction) -> SoftEnergy:
    """Return the energy of a stop at an exact angle."""
    return SoftEnergy(math.inf, 0.0, float(angle))


def _exact(guard: SoftGuard) -> tuple[Fraction, Fraction, Fraction]:
    """Return K, k and θ_s of the energy that a soft guard states."""
    angle = exact_number(guard.soft_angle)
    above, below = _coefficients(guard, (1, 0)), _coefficients(guard, (0, 1))
    stiffness = 2 * above[2]
    couple = above[1] + stiffness * angle
    wanted = [stiffness / 2 * angle**2 - couple * angle, couple - stiffness * angle, stiffness / 2]
    mirrored = [wanted[0], -wanted[1], wanted[2]]
    if (above, below, any(_coefficients(guard, (0, 0)))) != (wanted, mirrored, False):
        raise ValueError("a soft guard has another energy")
    if couple < 0 or stiffness < 0:
        raise ValueError("a soft guard pushes outwards")
    return couple, stiffness, angle


def _coefficients(guard: SoftGuard, mode: tuple[int, int]) -> list[Fraction]:
    """Return the energy as a polynomial in θ2 of degree 2, lowest power first."""
    ring = Ring(0, 1)
    (pitch,) = ring.variables()
    numbers: dict[str, Any] = {
        gain.name: ring.constant(exact_number(getattr(guard, gain.name))) for gain in guard.gains
    }
    energy = replace(guard, mode=np.array(mode, dtype=float), **numbers).energy(pitch)
    found = {powers[0]: fraction(value) for powers, value in energy.terms()}
    if max(found, default=0) > 2:
        raise ValueError("the energy of a soft guard has a higher power of θ2")
    return [found.get(power, Fraction(0)) for power in range(3)]
