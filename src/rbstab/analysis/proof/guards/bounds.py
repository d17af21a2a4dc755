"""Bounds over boxes on a reduced energy with guards.

Near ±π/2 the derivatives of a barrier change so fast that Taylor's theorem needs thin boxes. There
the exact bounds of its energy and slope over the box are sharper. A stiff guard has a bounded
second derivative, so its slope is known up to this bound times the distance from the centre. Where
the slope of a guard jumps in a box, it may have any value between those at the ends of the box.
"""

from dataclasses import dataclass, replace

import numpy as np

from rbstab.analysis.proof.box_bounds import Enclosure
from rbstab.analysis.proof.boxes import ROUNDING_FACTOR, Boxes
from rbstab.analysis.proof.guards.barrier import BarrierEnergy
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.soft import SoftEnergy
from rbstab.analysis.proof.trigonometric import ROUND_OFF, along
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH

SUM_ERROR = 1e-15
"""The relative error of a sum of a few numbers."""


@dataclass(frozen=True, eq=False)
class GuardedEnclosure(Enclosure):
    """Proved bounds on U with guards over each of m boxes.

    bare has the bounds on U without the guards. energy and slope bound the energy of the guards
    and its derivative by each angle over each box, from low to high, shapes (m, 2) and (m, 3, 2).
    """

    bare: Enclosure
    energy: Array
    slope: Array

    def negated(self) -> "GuardedEnclosure":
        """Return the bounds on -U."""
        return replace(
            self,
            value=-self.value,
            gradient=-self.gradient,
            hessian=-self.hessian,
            bare=self.bare.negated(),
            energy=-self.energy[:, ::-1],
            slope=-self.slope[:, :, ::-1],
            kinks=self.negated_kinks,
        )

    @property
    def monotonic(self) -> Array:
        """Whether a component of the gradient is proved to have no zero in the box, shape (m,)."""
        found = super().monotonic
        for axis in np.flatnonzero(np.any(self.slope != 0, axis=(0, 2))):
            found = found | self._monotonic_along(int(axis))
        return found

    def _monotonic_along(self, axis: int) -> Array:
        bare, radius = self.bare, self.bare.radius
        spread = np.einsum("mj,mj->m", np.abs(bare.hessian[:, axis]), radius)
        spread = (spread + bare.curvature[:, axis]) * ROUNDING_FACTOR
        low, high = self.slope[:, axis].T
        size = np.abs(bare.gradient[:, axis]) + spread
        rises = bare.gradient[:, axis] - spread + low > 1e-15 * (size + np.abs(low))
        falls = bare.gradient[:, axis] + spread + high < -1e-15 * (size + np.abs(high))
        return np.asarray(rises | falls)


@dataclass(frozen=True, eq=False)
class KinkedEnclosure(GuardedEnclosure):
    """Proved bounds on U with guards whose slope jumps at some values of θ2.

    jumps is whether it may jump in each box, shape (m,). There `gradient` and its error contain all
    slopes over the box, so they hold as before, but the Hessian does not bound the slope.

    smooth has the bounds on U without what jumps. below and above are lines below and above the
    energy of what jumps, all over the box: its value at the centre and its slope, shape (m, 2).
    """

    smooth: Enclosure
    jumps: Array
    below: Array
    above: Array

    def negated(self) -> "KinkedEnclosure":
        """Return the bounds on -U."""
        found = super().negated()
        assert isinstance(found, KinkedEnclosure)
        smooth = self.smooth.negated()
        return replace(found, smooth=smooth, below=-self.above, above=-self.below)

    @property
    def supported(self) -> Enclosure:
        """Bounds on U with the line below in place of what jumps: it is at most U."""
        smooth, line = self.smooth, self.below
        value, gradient = smooth.value + line[:, 0], smooth.gradient.copy()
        gradient[:, 1] += line[:, 1]
        error = np.broadcast_to(smooth.gradient_error, gradient.shape).copy()
        error[:, 1] += SUM_ERROR * (np.abs(gradient[:, 1]) + np.abs(line[:, 1]))
        value_error = smooth.value_error + SUM_ERROR * (np.abs(value) + np.abs(line[:, 0]))
        return replace(
            smooth,
            value=value,
            value_error=value_error,
            gradient=gradient,
            gradient_error=error,
            hessian_error=np.broadcast_to(smooth.hessian_error, smooth.hessian.shape),
        )

    @property
    def hessian_radius(self) -> Array:
        """Bound on the deviation of H from its value at the centre; none where the slope jumps."""
        found = super().hessian_radius
        found[self.jumps, 1, 1] = np.inf
        return found


def guarded(bare: Enclosure, guard: Guard, boxes: Boxes) -> GuardedEnclosure:
    """Add guards to bounds over boxes."""
    sides = [(boxes.low[:, k], boxes.high[:, k], boxes.centre[:, k]) for k in range(3)]
    pitch = sides[PITCH]
    energy, slope = np.zeros((len(boxes), 2)), np.zeros((len(boxes), 3, 2))
    for axis, function in guard.by_axis:
        low, high = function.over(*sides[axis][:2])
        energy = energy + np.stack([low[0], high[0]], axis=1)
        slope[:, axis] = np.stack([low[1], high[1]], axis=1)
    smooth: Enclosure = bare
    if guard.barrier is not None:
        smooth = _with_barrier(smooth, PITCH, guard.barrier, pitch)
    for axis in (0, 2) if guard.outer is not None else ():
        assert guard.outer is not None
        smooth = _with_barrier(smooth, axis, guard.outer, sides[axis])
        # The sum is rounded.
        energy += 1e-15 * np.abs(energy) * [-1.0, 1.0]
    whole = smooth
    for part in guard.soft:
        whole = _with_soft(whole, part, pitch)
        if part.couple == 0:
            smooth = _with_soft(smooth, part, pitch)
    found = GuardedEnclosure(**vars(whole), bare=bare, energy=energy, slope=slope)
    if not guard.jumps:
        return found
    steep = smooth.gradient[:, 1]
    return KinkedEnclosure(
        **vars(found),
        smooth=smooth,
        jumps=np.any([one.jumps(*pitch[:2]) for one in guard.jumps], axis=0),
        below=np.sum([_line_below(one, pitch, steep) for one in guard.jumps], axis=0),
        above=np.sum([_line_above(one, pitch) for one in guard.jumps], axis=0),
    )


Side = tuple[Array, Array, Array]
"""The lower ends, the upper ends and the centres of boxes along an axis, shape (m,) each, rad."""


def _with_barrier(bare: Enclosure, axis: int, barrier: BarrierEnergy, side: Side) -> Enclosure:
    """Add a barrier on one angle to bounds over boxes."""
    low, high, centre = side
    least, most = barrier.over(low, high)
    at_centre = zip(*barrier.at(centre, 2), strict=True)
    value, value_error = _plus(bare.value, bare.value_error, axis, *next(at_centre))
    gradient, gradient_error = _plus(bare.gradient, bare.gradient_error, axis, *next(at_centre))
    hessian, hessian_error = _plus(bare.hessian, bare.hessian_error, axis, *next(at_centre))
    third = bare.third.copy()
    third[:, axis, axis, axis] += np.maximum(-least[3], most[3])
    return Enclosure(
        bare.radius,
        value,
        value_error,
        gradient,
        gradient_error,
        hessian,
        hessian_error,
        third * ROUNDING_FACTOR,
    )


def _with_soft(found: Enclosure, part: SoftEnergy, pitch: Side) -> Enclosure:
    """Add a soft guard or a stop to bounds over boxes.

    With the slope s and the curvature c in their bounds, its energy over a box is that at the
    centre plus sδ + ½ cδ², and its slope is s + cδ.
    """
    between = part.between(*pitch)
    value, value_error = _plus(found.value, found.value_error, PITCH, *between.value)
    gradient, gradient_error = _plus_middle(found.gradient, found.gradient_error, between.slope)
    hessian, hessian_error = _plus_middle(found.hessian, found.hessian_error, between.curvature)
    return Enclosure(
        found.radius,
        value,
        value_error,
        gradient,
        gradient_error,
        hessian,
        hessian_error,
        found.third,
    )


def _plus(values: Array, error: Array, axis: int, low: Array, high: Array) -> tuple[Array, Array]:
    """Add a function of one angle that lies between bounds at each centre; with its errors."""
    total, wider = values.copy(), np.broadcast_to(error, values.shape).copy()
    place = along(values, axis)
    total[place] += low
    # The difference and the sum are rounded.
    wider[place] += (high - low) + 2 * ROUND_OFF * np.abs(total[place])
    return total, wider * ROUNDING_FACTOR + np.finfo(float).tiny


def _plus_middle(values: Array, error: Array, bounds: tuple[Array, Array]) -> tuple[Array, Array]:
    """Do the same for bounds that are wide: the middle is added; without a bound nothing is."""
    low, high = bounds
    finite = np.isfinite(low) & np.isfinite(high)
    middle = np.where(finite, 0.5 * (low + high), 0.0)
    radius = np.where(finite, 0.5 * (high - low), np.inf)
    size = np.where(finite, np.abs(low) + np.abs(high), 0.0)
    total, wider = values.copy(), np.broadcast_to(error, values.shape).copy()
    place = along(values, PITCH)
    total[place] += middle
    wider[place] += radius + 4 * ROUND_OFF * (size + np.abs(total[place]))
    return total, wider * ROUNDING_FACTOR + np.finfo(float).tiny


def _line_below(part: SoftEnergy, pitch: Side, steep: Array) -> Array:
    """Return a line below the energy of a guard over boxes: value at the centre, slope, (m, 2).

    It is tangent at the angle of the guard, ±θ_s, if that is in the box. Any slope between those on
    both sides will do; the best is the one that balances the slope of all else. Else it is zero.
    """
    low, high, centre = pitch
    above = part.jumps(low, high) & (low > 0)
    below = part.jumps(low, high) & (high < 0)
    slope = np.where(above, np.clip(-steep, 0.0, part.couple), 0.0)
    slope = np.where(below, np.clip(-steep, -part.couple, 0.0), slope)
    # s(θ2 - θ_s) with s >= 0 is least for the largest θ_s, and mirrored.
    kink = np.where(above, part.outer, -part.outer)
    value = slope * (centre - kink)
    # The couple is rounded once; a slope a little less is between both sides as well.
    safe = 1 - 2.0**-50
    return np.stack([_fallen(value * safe, slope), slope * safe], axis=1)


def _fallen(value: Array, slope: Array) -> Array:
    """Lower the values of lines by more than their rounding."""
    found: Array = value - 2.0**-48 * (np.abs(value) + np.abs(slope))
    return found


def _line_above(part: SoftEnergy, pitch: Side) -> Array:
    """Return the chord of the energy of a guard over boxes: it is convex, so nowhere above it."""
    low, high, centre = pitch
    ends = [part.over(angles, angles)[1][0] for angles in (low, high)]
    width = np.maximum(high - low, np.finfo(float).tiny)
    slope = np.where(high > low, (ends[1] - ends[0]) / width, 0.0)
    value = np.maximum(ends[0] + slope * (centre - low), ends[1] + slope * (centre - high))
    spread = np.abs(slope) * (high - low)
    size = np.abs(ends[0]) + np.abs(ends[1]) + spread
    return np.stack([value + 2.0**-48 * (size + np.abs(value)), slope], axis=1)
