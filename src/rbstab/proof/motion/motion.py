"""All motions from sets of starts, step by step. Where no step is proved, a set is halved."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.motion.crossing import switching_step
from rbstab.proof.motion.equations import Equations
from rbstab.proof.motion.motion_set import MotionSet
from rbstab.proof.motion.step import SetSteps, set_steps

FIRST_STEP = 0.05
"""s: the first step is at most this long."""

SHORTEST = 1e-7
"""s: a single motion whose smooth steps would be shorter is given up."""

SHORTEST_OF_SET = 1.0 / 64
"""A step of a set is at least this fraction of the longest one before; else the set is halved."""

SHORTEST_FIRST = 1e-5
"""s: the first step of a set is at least this long."""

MAX_ERROR = 1e-2
"""The largest error |Qw| of a set, in scaled states; with a larger one the set is halved."""

MAX_TIME = 2.0**12
"""s: up to here, sums of multiples of 2⁻⁴⁰ s are exact doubles; no motion goes on."""

MAX_STEPS = 500
"""Steps after which a set is given up. The motions of the paper need some 120."""

Decide = Callable[[MotionSet, Array, Array], Sequence[Any]]
"""Returns what is decided of each of several sets, None for nothing. It is called with the sets,
their times, shape (sets,), s, and their places among all starts, shape (sets,)."""

Watch = Callable[[float, SetSteps], None]
"""Called with the time at the beginning of each proved step, s, and the step: of one set alone."""


class Followed(NamedTuple):
    """What came of a set of starts.

    Attributes:
        steps: The number of steps.
        time: The time at their end, s; exact.
        decision: What is decided of the set; None if nothing is.
        variable: The number of the z along which to halve it; None if it is decided, given up, or
            about a single start.
        lost: Whether no further step was proved.
        switch: The name of the element that may have switched there, if it is lost; else empty.
    """

    steps: int
    time: float
    decision: Any = None
    variable: int | None = None
    lost: bool = False
    switch: str = ""


@dataclass(frozen=True, eq=False)
class _Running:
    """Sets that are followed: one entry for each."""

    number: Array  # the place among all starts
    states: MotionSet
    steps: Array
    time: Array
    longest: Array  # the largest next step, s
    largest: Array  # the longest step so far, s

    def __getitem__(self, chosen: Array | slice) -> "_Running":
        parts = (self.steps, self.time, self.longest, self.largest)
        return _Running(self.number[chosen], self.states[chosen], *(part[chosen] for part in parts))

    @property
    def shortest(self) -> Array:
        """The shortest step that is worth while, s: about a set, a half of it needs fewer."""
        if not self.states.space.variables:
            return np.full(len(self.number), SHORTEST)
        return np.where(self.steps > 0, SHORTEST_OF_SET * self.largest, SHORTEST_FIRST)

    def moved(self, step: SetSteps, longest: Array, scale: Array) -> "tuple[_Running, Array]":
        """Return the sets after one more step, and which of them are lost."""
        h = np.where(step.proved, step.h, 0.0)
        narrow = np.all(step.end.error <= MAX_ERROR * scale, axis=-1)
        usable = narrow & (self.time + h <= MAX_TIME)
        lost = np.where(step.proved, ~usable, longest < self.shortest)
        states = self.states.replaced(step.proved, step.end)
        largest = np.maximum(self.largest, h)
        steps, time = self.steps + step.proved, self.time + h
        return _Running(self.number, states, steps, time, longest, largest), lost

    def ended(self, k: int, *rest: Any) -> Followed:
        """Return what came of the k-th set: its steps and its time, and the rest."""
        return Followed(int(self.steps[k]), float(self.time[k]), *rest)

    def most_nonlinear(self, k: int, scale: Array) -> int | None:
        """Return along which z to halve the k-th set; None for a single start."""
        nonlinearity = self.states[k : k + 1].nonlinearity(scale)[0]
        return int(nonlinearity.argmax()) if len(nonlinearity) else None


@np.errstate(all="ignore")  # numbers that are not finite fail every test
def followed(  # noqa: PLR0913, PLR0917 (two of them are options)
    equations: Equations,
    starts: MotionSet,
    scale: Array,
    decide: Decide,
    max_steps: int = MAX_STEPS,
    watch: Watch | None = None,
) -> list[Followed]:
    """Follow several sets of motions until each is decided, or has to be halved.

    What is found of a set does not depend on the others.

    Args:
        equations: The equations.
        starts: The sets of the starts.
        scale: The size of each state, shape (n,).
        decide: Returns what is decided of sets.
        max_steps: The most steps of a set.
        watch: Called after each step, if there is one set.
    """
    count, zero = len(starts), np.zeros(len(starts))
    all_sets = _Running(np.arange(count), starts, zero.astype(int), zero, zero + FIRST_STEP, zero)
    # Sets of a system that switches are in different modes, and are followed one by one.
    groups = [all_sets[k : k + 1] for k in range(count)] if equations.switches else [all_sets]
    by_number: dict[int, Followed] = {}
    for group in groups:
        running = group
        while len(running.number):
            decisions = decide(running.states, running.time, running.number)
            left = running.steps < max_steps
            left &= [decision is None for decision in decisions]
            for k in np.flatnonzero(~left).tolist():
                by_number[int(running.number[k])] = running.ended(k, decisions[k])
            running = running[left]
            if not len(running.number):
                break
            step, longest, switch = _next(equations, running, scale)
            if watch is not None and step.proved[0]:
                watch(float(running.time[0]), step)
            moved, lost = running.moved(step, longest, scale)
            for k in np.flatnonzero(lost).tolist():
                variable = running.most_nonlinear(k, scale)
                by_number[int(running.number[k])] = running.ended(k, None, variable, True, switch)
            running = moved[~lost]
    return [by_number[number] for number in range(count)]


def _next(equations: Equations, running: _Running, scale: Array) -> tuple[SetSteps, Array, str]:
    """Return a step of each set, the largest one to be tried after it, and what may switch."""
    if equations.switches:
        return switching_step(equations, running.states, scale, running.longest)
    step = set_steps(equations.field(), running.states, scale, running.longest)
    return step, step.longest_after(running.longest), ""
