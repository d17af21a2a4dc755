"""A bound on the slope of a periodic function of Θ, by halving boxes."""

import heapq
import math
from collections.abc import Callable, Mapping, Sequence

from flint import arb

from rbstab.analysis.proof_check.boxes import AXES, Box, halves
from rbstab.analysis.proof_check.trigonometric import Axes, Ball, axes_of

BOX_LIMIT = 20_000
"""The number of boxes at which the search stops."""

FACTOR = 1.15
"""The bound is at most this times the largest slope that was seen."""

CELL: Box = ((-3.2, 3.2), (-1.6, 1.6), (-3.2, 3.2))
"""It contains all θ1 and θ3 up to whole turns, and |θ2| <= π/2."""

Derivatives = Callable[[Sequence[Ball]], Mapping[Axes, Ball]]


def largest_slope(derivatives: Derivatives, axis: int) -> Ball | None:
    """Return a bound on the slope along an axis; None if none is found.

    Args:
        derivatives: Returns the derivatives at a ball of Θ up to order 3, by their axes.
        axis: The index of the angle.
    """
    seen = 0.0
    # The box with the largest bound is halved next. No number counts as the largest.
    pending = [(-math.inf, CELL)]
    for _ in range(BOX_LIMIT):
        negative, box = heapq.heappop(pending)
        if -negative <= FACTOR * seen:
            return arb(-negative)
        for half in halves(box)[1:]:
            at_centre, size = _slopes(derivatives, half, axis)
            if at_centre.is_finite():
                seen = max(seen, float(abs(at_centre).lower()))
            bound = math.nextafter(float(size.upper()), math.inf)
            heapq.heappush(pending, (-math.inf if math.isnan(bound) else -bound, half))
    return None


def _slopes(derivatives: Derivatives, box: Box, axis: int) -> tuple[Ball, Ball]:
    """Return the slope at the centre of a box, and a bound on its magnitude in all of it."""
    centre = [arb(low / 2 + high / 2) for low, high in box]
    whole = [arb(low).union(arb(high)) for low, high in box]
    step = [wide - middle for wide, middle in zip(whole, centre, strict=True)]
    at_centre, over = derivatives(centre), derivatives(whole)
    total = at_centre[axis,]
    for j in AXES:
        bend = at_centre[axes_of(axis, j)]
        bend += sum((over[axes_of(axis, j, k)] * step[k] for k in AXES), arb(0)) / 2
        total += bend * step[j]
    return at_centre[axis,], total.abs_upper()
