"""Bounds on |θ1| and |θ3| at all rest states: theorem 6, with the largest slopes of an energy."""

import copy
import heapq
import math
from collections.abc import Callable
from functools import partial

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES, Box, halves
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.taylor import Taylor
from rbstab.analysis.proof_check.trigonometric import Ball

BOX_LIMIT = 20_000
"""The number of boxes at which the search stops."""

FACTOR = 1.25
"""The bound is at most this times the largest slope that was seen."""

CELL: Box = ((-3.2, 3.2), (-1.6, 1.6), (-3.2, 3.2))
"""It contains all θ1 and θ3 up to whole turns, and |θ2| <= π/2."""

Slope = Callable[[Box], tuple[Ball, Ball]]
"""Returns the slope at the centre of a box, and a bound on its magnitude in all of it."""


def largest_slope(slope: Slope) -> Ball | None:
    """Return a bound on a slope; None if none is found.

    Args:
        slope: The slope.
    """
    seen = 0.0
    # The box with the largest bound is halved next. No number counts as the largest.
    pending = [(-math.inf, CELL)]
    for _ in range(BOX_LIMIT):
        negative, box = heapq.heappop(pending)
        if -negative <= FACTOR * seen:
            return arb(-negative)
        for half in halves(box)[1:]:
            at_centre, size = slope(half)
            if at_centre.is_finite():
                seen = max(seen, float(abs(at_centre).lower()))
            bound = math.nextafter(float(size.upper()), math.inf)
            heapq.heappush(pending, (-math.inf if math.isnan(bound) else -bound, half))
    return None


def confined(U: Energy, first: Ball, third: Ball) -> bool:
    """Return whether all rest states with |θ2| <= π/2 have |θ1| < first and |θ3| < third.

    Bounds on single terms are tried before a search for the largest slopes, which takes long. They
    need a periodic part: formulas of users must be so.
    """
    if not all(one.periodic for one in U.of_users):
        return False
    for slope in (U.steepest, partial(_sharper, U)):
        bound = confinement(U, slope)
        if bound is not None and bool(bound[0] < first) and bool(bound[1] < third):
            return True
    return False


def confinement(U: Energy, slope: Callable[[int], Ball] | None = None) -> list[Ball] | None:
    """Bound |θ1| and |θ3| at all rest states with |θ2| <= π/2; None if k is not definite.

    k [θ1, θ3]' = -[q1 + K12 θ2 + ∂p/∂θ1, q3 + K32 θ2 + ∂p/∂θ3]' with the periodic part p.

    Args:
        U: The energy.
        slope: Bounds |∂p/∂θ| along an axis; by default as sharp as can be.
    """
    slope = slope or partial(_sharper, U)
    Q = U.quadratic
    k = arb_mat([[Q[i][j] for j in (0, 2)] for i in (0, 2)])
    if not (k[0, 0] > 0 and k.det() > 0):
        return None
    inverse = k.inv()
    load = [abs(U.linear[j]) + abs(Q[j][1]) * arb.pi() / 2 + slope(j) for j in (0, 2)]
    return [sum((abs(inverse[i, j]) * load[j] for j in (0, 1)), arb(0)) for i in (0, 1)]


def _sharper(U: Energy, axis: int) -> Ball:
    """Bound |∂p/∂θ| for |θ2| <= π/2: with lines, the bounds of single terms are too large."""
    single = U.steepest(axis)
    if not U.lines and not U.of_users and U.position is None:
        return single
    periodic = copy.copy(U)
    periodic.barriers, periodic.guards = [], []
    periodic.quadratic = [[arb(0)] * 3 for _ in AXES]
    periodic.linear = [arb(0)] * 3

    def slope(box: Box) -> tuple[Ball, Ball]:
        taylor = Taylor(periodic, box)
        return taylor.gradient[axis, 0], taylor.whole_gradient[axis, 0].abs_upper()

    found = largest_slope(slope)
    U.evaluations = periodic.evaluations
    return single if found is None or not found < single else found
