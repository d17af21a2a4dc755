"""A bound on the largest slope of a function over all of the range, by halving boxes."""

import heapq
import math
from collections.abc import Callable

from flint import arb

from rbstab.analysis.proof_check.boxes import Box, halves
from rbstab.analysis.proof_check.trigonometric import Ball

BOX_LIMIT = 20_000
"""The number of boxes at which the search stops."""

FACTOR = 1.25
"""The bound is at most this times the largest slope that was seen."""

CELL: Box = ((-3.2, 3.2), (-1.6, 1.6), (-3.2, 3.2))
"""It contains all θ1 and θ3 up to whole turns, and |θ2| <= π/2."""

Slope = Callable[[Box], tuple[Ball, Ball]]
"""Returns the slope at the centre of a box, and a bound on its magnitude in all of it."""


def largest_slope(
    slope: Slope, factor: float = FACTOR, limit: int = BOX_LIMIT, enough: float = 0.0
) -> Ball | None:
    """Return a bound on a slope; None if none is found.

    Args:
        slope: The slope.
        factor: The bound is at most this times the largest slope that was seen.
        limit: The number of boxes that are halved at most.
        enough: A bound that need not be closer.
    """
    seen = 0.0
    # The box with the largest bound is halved next. No number counts as the largest.
    pending = [(-math.inf, CELL)]
    for _ in range(limit):
        negative, box = heapq.heappop(pending)
        if -negative <= max(factor * seen, enough):
            return arb(-negative)
        for half in halves(box)[1:]:
            at_centre, size = slope(half)
            if at_centre.is_finite():
                seen = max(seen, float(abs(at_centre).lower()))
            bound = math.nextafter(float(size.upper()), math.inf)
            heapq.heappush(pending, (-math.inf if math.isnan(bound) else -bound, half))
    return None
