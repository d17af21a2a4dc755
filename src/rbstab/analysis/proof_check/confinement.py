"""Bounds on |θ1| and |θ3| at all rest states: theorem 6, with the largest slopes of an energy."""

import copy
import heapq
import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES, Box, halves
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.taylor import Taylor
from rbstab.analysis.proof_check.trigonometric import Ball

OUTER = (0, 2)
"""The axes of θ1 and θ3."""

SHARE = 0.98
"""A search for bounds on slopes aims at this share of the largest ones that prove the claim."""

BOX_LIMIT = 20_000
"""The number of boxes at which the search stops."""

FACTOR = 1.25
"""A bound is at most this times the largest slope that was seen, or enough."""

CELL: Box = ((-3.2, 3.2), (-1.6, 1.6), (-3.2, 3.2))
"""It contains all θ1 and θ3 up to whole turns, and |θ2| <= π/2."""

Slope = Callable[[Box], tuple[Ball, Ball]]
"""Returns the slope at the centre of a box, and a bound on its magnitude in all of it."""


def largest_slope(slope: Slope, enough: float = 0.0) -> Ball | None:
    """Return a bound on a slope; None if none is found.

    Args:
        slope: The slope.
        enough: A bound that need not be closer.
    """
    seen = 0.0
    # The box with the largest bound is halved next. No number counts as the largest.
    pending = [(-math.inf, CELL)]
    for _ in range(BOX_LIMIT):
        negative, box = heapq.heappop(pending)
        if -negative <= max(FACTOR * seen, enough):
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

    Bounds on single terms are tried before a search for the largest slopes, which takes long.
    Formulas of users must be periodic in θ1 and θ3.
    """
    if not all(one.periodic for one in U.of_users):
        return False
    enough = _enough(U, float(first.lower()), float(third.lower()))
    for slope in (U.steepest, _Slopes(U, enough).largest):
        bound = confinement(U, slope)
        if bound is not None and bool(bound[0] < first) and bool(bound[1] < third):
            return True
    return False


def confinement(U: Energy, slope: Callable[[int], Ball] | None = None) -> list[Ball] | None:
    """Bound |θ1| and |θ3| at all rest states with |θ2| <= π/2; None if k is not definite.

    k [θ1, θ3] = -[q1 + K12 θ2 + ∂p/∂θ1, q3 + K32 θ2 + ∂p/∂θ3] with the periodic part p, and with
    the quadratic part ½ Θ'KΘ + q'Θ of U and the block k of K for θ1 and θ3.

    Args:
        U: The energy.
        slope: Bounds |∂p/∂θ| along an axis; by default as sharp as can be.
    """
    slope = slope or _Slopes(U).largest
    inverse = _compliance(U)
    if inverse is None:
        return None
    load = [one + slope(j) for one, j in zip(_loads(U), OUTER, strict=True)]
    return [sum((abs(inverse[i, j]) * load[j] for j in (0, 1)), arb(0)) for i in (0, 1)]


def _compliance(U: Energy) -> Any:
    """Return k⁻¹; None if k is not definite."""
    k = arb_mat([[U.quadratic[i][j] for j in OUTER] for i in OUTER])
    return k.inv() if k[0, 0] > 0 and k.det() > 0 else None


def _loads(U: Energy) -> list[Ball]:
    """Bound |q + K θ2| along both axes."""
    return [abs(U.linear[j]) + abs(U.quadratic[j][1]) * arb.pi() / 2 for j in OUTER]


def _enough(U: Energy, first: float, third: float) -> dict[int, float]:
    """Return bounds on the slopes along both axes that need not be closer: not proved."""
    inverse = _compliance(U)
    if inverse is None:
        return {}
    a, b, c, d = (abs(float(inverse[i, j].mid())) for i in (0, 1) for j in (0, 1))
    determinant = a * d - b * c
    if not determinant > 0:
        return {}
    most = ((d * first - b * third) / determinant, (a * third - c * first) / determinant)
    loads = (float(one.upper()) for one in _loads(U))
    return {j: SHARE * one - load for j, one, load in zip(OUTER, most, loads, strict=True)}


class _Slopes:
    """The largest slopes of the periodic part p of an energy.

    Args:
        U: The energy.
        enough: Bounds that need not be closer, by their axes.
    """

    def __init__(self, U: Energy, enough: Mapping[int, float] = MappingProxyType({})) -> None:
        self.U, self.enough = U, enough
        self.periodic = copy.copy(U)
        self.periodic.barriers, self.periodic.guards = [], []
        self.periodic.quadratic = [[arb(0)] * 3 for _ in AXES]
        self.periodic.linear = [arb(0)] * 3
        self.known = dict[Box, tuple[list[Ball], list[Ball]]]()

    def largest(self, axis: int) -> Ball:
        """Bound |∂p/∂θ| for |θ2| <= π/2: with lines, the bounds of single terms are too large."""
        U = self.U
        single = U.steepest(axis)
        if not U.lines and not U.of_users and U.position is None:
            return single

        def slope(box: Box) -> tuple[Ball, Ball]:
            at_centre, whole = self._gradients(box)
            return at_centre[axis], whole[axis].abs_upper()

        found = largest_slope(slope, enough=self.enough.get(axis, 0.0))
        U.evaluations = self.periodic.evaluations
        return single if found is None or not found < single else found

    def _gradients(self, box: Box) -> tuple[list[Ball], list[Ball]]:
        """Return the gradient at the centre of a box, and over it."""
        if box not in self.known:
            taylor = Taylor(self.periodic, box)
            self.known[box] = taylor.gradient.entries(), taylor.whole_gradient.entries()
        return self.known[box]
