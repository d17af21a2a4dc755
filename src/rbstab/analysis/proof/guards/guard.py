"""All that guards add to the reduced energy: convex and even functions of single angles."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbstab.analysis.proof.guards.barrier import BarrierEnergy
from rbstab.analysis.proof.guards.soft import SoftEnergy
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH


@dataclass(frozen=True)
class Guard:
    """The sum g(θ2) of the energies of guards, J, and its derivatives; and the sums on θ1 and θ3.

    g is even and convex, and its slope may jump where a repelling guard begins. A stop allows no
    |θ2| beyond its angle; there it adds nothing to g, and any couple toward the inside.

    Args:
        barrier: The sum of the barriers; None without one.
        soft: The stiff and repelling guards, and the stops.
        outer: The barrier g_o on θ1, and on θ3; None without one. No other function of this class
            counts it, but for `by_axis`.
    """

    barrier: BarrierEnergy | None = None
    soft: tuple[SoftEnergy, ...] = ()
    outer: BarrierEnergy | None = None

    @property
    def by_axis(self) -> "list[tuple[int, Guard | BarrierEnergy]]":
        """The axis of each angle with guards, and their sum."""
        outer = [] if self.outer is None else [(axis, self.outer) for axis in (0, 2)]
        return [*([(PITCH, self)] if self._parts else []), *outer]

    def closes(self, axis: int) -> bool:
        """Return whether no motion reaches the ends of the range of eq. 5 along an axis."""
        return self.closed if axis == PITCH else self.outer is not None

    @property
    def closed(self) -> bool:
        """Whether no motion reaches θ2 = ±π/2, as there is a barrier or a stop."""
        return self.barrier is not None or self.stop is not None

    @property
    def stop(self) -> float | None:
        """The least angle of a stop, rad; None without one."""
        return min((one.angle for one in self.soft if one.is_stop), default=None)

    @property
    def end(self) -> float:
        """A double that is not below the largest |θ2| which stops allow, rad; else infinite."""
        ends = (one.outer * (1 + 2.0**-50) for one in self.soft if one.is_stop)
        return min(ends, default=math.inf)

    @cached_property
    def jumps(self) -> tuple[SoftEnergy, ...]:
        """The guards at whose angles the slope of g jumps."""
        return tuple(one for one in self.soft if one.couple > 0)

    @property
    def without_barrier(self) -> "Guard | None":
        """The guards but for the barriers; None if there is no other."""
        return Guard(None, self.soft) if self.soft else None

    def without(self, jump: SoftEnergy) -> "Guard":
        """Return the guards without one of them."""
        soft = list(self.soft)
        soft.remove(jump)
        return Guard(self.barrier, tuple(soft), self.outer)

    def approximate(self, angles: Array, order: int) -> list[Array]:
        """Return the derivatives of order 0 to `order` at angles of shape (m,), to round-off.

        At a jump of the slope it is that of the inner side.
        """
        found = [np.zeros_like(angles) for _ in range(order + 1)]
        for part in self._parts:
            added = part.approximate(angles, order)
            found = [one + other for one, other in zip(found, added, strict=True)]
        return found

    def at(self, angles: Array, order: int) -> tuple[Array, Array]:
        """Return proved bounds on the derivatives of order 0 to `order` at angles of shape (m,).

        Returns:
            Lower and upper bounds, each of shape (order + 1, m); infinite where there are none.
        """
        return _sums([part.at(angles, order) for part in self._parts])

    def over(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Return proved bounds on the derivatives of order 0 to 3 over intervals of θ2.

        Args:
            low: The lower ends, shape (m,), rad.
            high: The upper ends.

        Returns:
            Lower and upper bounds, each of shape (4, m).
        """
        return _sums([part.over(low, high) for part in self._parts])

    @property
    def _parts(self) -> list[BarrierEnergy | SoftEnergy]:
        return [*([] if self.barrier is None else [self.barrier]), *self.soft]


def _sums(bounds: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Add lower bounds and upper bounds, rounded outwards."""
    (low, high), *others = bounds
    for least, most in others:
        low, high = np.nextafter(low + least, -np.inf), np.nextafter(high + most, np.inf)
    return low, high
