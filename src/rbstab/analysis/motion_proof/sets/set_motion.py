"""All motions from a set of starts, step by step. Where no step is proved, the set is halved."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.motion_proof.sets.equations import Equations
from rbstab.analysis.motion_proof.sets.motion_set import MotionSet
from rbstab.analysis.motion_proof.sets.set_step import set_step
from rbstab.mechanics.numbers import Array

FIRST_STEP = 0.004
"""s: the first step is at most this long."""

GROWTH = 1.5
"""A step may be longer than the one before by this factor."""

SHORTEST = 1.0 / 64
"""A step is at least this fraction of the longest one before; otherwise the set is halved."""

MAX_ERROR = 1e-2
"""The largest error |Qw| of a set, in scaled states; with a larger one the set is halved."""

NARROWEST = 2.0**-40
"""A part with this width in z is not halved, so that the bounds of all parts are exact doubles."""

MAX_STEPS = 500
"""Steps after which a set is given up. The motions of the paper need some 120."""


@dataclass(frozen=True, eq=False)
class Part:
    """A part of the starts.

    Args:
        low: The smallest z of the part, shape (variables,), in the z of the whole; exact.
        high: The largest one.
        start: The set of its starts.
    """

    low: Array
    high: Array
    start: MotionSet

    def can_be_halved(self, variable: int) -> bool:
        """Return whether the bounds of its halves along one variable are exact."""
        return bool(self.high[variable] - self.low[variable] > NARROWEST)

    def halves(self, variable: int) -> "tuple[Part, Part]":
        """Return the two halves of the part along one variable."""
        middle = (self.low[variable] + self.high[variable]) / 2
        lower, upper = self.start.halves(variable)
        high, low = self.high.copy(), self.low.copy()
        high[variable] = low[variable] = middle
        return Part(self.low, high, lower), Part(low, self.high, upper)


class Followed(NamedTuple):
    """What came of a part.

    Attributes:
        steps: The number of steps.
        time: The time at their end, s, rounded up.
        decision: What is decided of the part; None if nothing is.
        variable: The number of the z along which to halve it; None if it is decided or given up.
    """

    steps: int
    time: float
    decision: Any = None
    variable: int | None = None


def whole(states: MotionSet) -> Part:
    """Return all starts as a part."""
    ones = np.ones(states.space.variables)
    return Part(-ones, ones, states)


def followed(
    equations: Equations,
    start: MotionSet,
    scale: Array,
    decision_of: Callable[[MotionSet, float], Any],
) -> Followed:
    """Follow a set of motions until it is decided, or has to be halved.

    Call it in `proof_precision`.

    Args:
        equations: The equations.
        start: The set of the starts.
        scale: The size of each state, shape (n,).
        decision_of: Returns what is decided of a set at a time; None if nothing is.
    """
    states, time, longest, largest = start, 0.0, FIRST_STEP, 0.0
    for steps in range(MAX_STEPS + 1):
        decision = decision_of(states, time)
        if decision is not None:
            return Followed(steps, time, decision)
        step = None
        while step is None and longest >= SHORTEST * max(largest, FIRST_STEP / 8):
            step = set_step(equations, states, scale, longest)
            longest = longest / 2
        if step is None or not np.all(step.end.error <= MAX_ERROR * scale):
            variable = int(states.nonlinearity(scale).argmax())
            return Followed(steps, time, variable=variable)
        states, longest = step.end, GROWTH * step.h
        time = math.nextafter(time + step.h, math.inf)
        largest = max(largest, step.h)
    return Followed(MAX_STEPS, time)
