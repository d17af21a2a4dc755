"""All motions from a set of starts, step by step. Where no step is proved, the set is halved."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.motion_proof.sets.equations import Equations
from rbstab.analysis.motion_proof.sets.motion_set import MotionSet
from rbstab.analysis.motion_proof.sets.set_step import FOR_SETS, Orders, SetSteps, set_steps
from rbstab.mechanics.numbers import Array

FIRST_STEP = 0.05
"""s: the first step is at most this long."""

GROWTH = 1.5
"""A step may be longer than the one before by this factor."""

SHORTEST = 1.0 / 64
"""A step is at least this fraction of the longest one before; otherwise the set is halved."""

SHORTEST_FIRST = 1e-5
"""s: the first step is at least this long."""

MAX_ERROR = 1e-2
"""The largest error |Qw| of a set, in scaled states; with a larger one the set is halved."""

NARROWEST = 2.0**-40
"""A part with this width in z is not halved, so that the bounds of all parts are exact doubles."""

MAX_STEPS = 500
"""Steps after which a set is given up. The motions of the paper need some 120."""


Decide = Callable[[MotionSet, Array, Array], Sequence[Any]]
"""Returns what is decided of each of several sets, None for nothing. It is called with the sets,
their times, shape (sets,), s, and their places among all starts, shape (sets,)."""


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
    """What came of a set of starts.

    Attributes:
        steps: The number of steps.
        time: The time at their end, s, rounded up.
        decision: What is decided of the set; None if nothing is.
        variable: The number of the z along which to halve it; None if it is decided or given up.
    """

    steps: int
    time: float
    decision: Any = None
    variable: int | None = None


def whole(states: MotionSet) -> Part:
    """Return all starts of one set as a part."""
    ones = np.ones(states.space.variables)
    return Part(-ones, ones, states)


@dataclass(frozen=True, eq=False)
class _Running:
    """The sets that are still followed; all arrays have one entry for each.

    number is the place of the set among all starts. longest is the largest next step, and largest
    the largest step so far, s.
    """

    number: Array
    states: MotionSet
    steps: Array
    time: Array
    longest: Array
    largest: Array

    def __getitem__(self, chosen: Array) -> "_Running":
        parts = (self.steps, self.time, self.longest, self.largest)
        return _Running(self.number[chosen], self.states[chosen], *(part[chosen] for part in parts))

    def ended(self, k: int, decision: Any = None, variable: int | None = None) -> Followed:
        """Return what came of the k-th set."""
        return Followed(int(self.steps[k]), float(self.time[k]), decision, variable)


def followed(  # noqa: PLR0913, PLR0917 (two of them are options)
    equations: Equations,
    starts: MotionSet,
    scale: Array,
    decide: Decide,
    max_steps: int = MAX_STEPS,
    orders: Orders = FOR_SETS,
) -> list[Followed]:
    """Follow several sets of motions until each is decided, or has to be halved.

    What is found of a set does not depend on the others.

    Args:
        equations: The equations.
        starts: The sets of the starts.
        scale: The size of each state, shape (n,).
        decide: Returns what is decided of sets.
        max_steps: The most steps of a set.
        orders: How far the series of the steps go.
    """
    found: dict[int, Followed] = {}
    zero = np.zeros(len(starts))
    running = _Running(
        np.arange(len(starts)), starts, zero.astype(int), zero, zero + FIRST_STEP, zero
    )
    with np.errstate(all="ignore"):  # what is not finite fails every test
        while len(running.number):
            decisions = decide(running.states, running.time, running.number)
            left = np.ones(len(decisions), dtype=bool)
            for k, decision in enumerate(decisions):
                if decision is not None or running.steps[k] >= max_steps:
                    found[int(running.number[k])] = running.ended(k, decision)
                    left[k] = False
            running = running[left]
            if len(running.number):
                step = set_steps(equations, running.states, scale, running.longest, orders)
                running = _moved(running, step, scale, found)
    return [found[number] for number in range(len(starts))]


def _moved(running: _Running, step: SetSteps, scale: Array, found: dict[int, Followed]) -> _Running:
    """Return the sets after one more step; those that have to be halved are put into `found`."""
    shorter = running.longest / 2
    narrow = np.all(step.end.error <= MAX_ERROR * scale, axis=-1)
    again = shorter >= np.where(running.steps > 0, SHORTEST * running.largest, SHORTEST_FIRST)
    lost = np.where(step.proved, ~narrow, ~again)
    for k in np.flatnonzero(lost).tolist():
        nonlinear = running.states[k : k + 1].nonlinearity(scale)[0]
        variable = int(nonlinear.argmax()) if len(nonlinear) else None
        found[int(running.number[k])] = running.ended(k, variable=variable)
    moved = step.proved
    states = running.states.replaced(moved, step.end)
    new = _Running(
        running.number,
        states,
        running.steps + moved,
        np.where(moved, np.nextafter(running.time + step.h, np.inf), running.time),
        np.where(moved, GROWTH * step.h, shorter),
        np.where(moved, np.maximum(running.largest, step.h), running.largest),
    )
    return new[~lost]
