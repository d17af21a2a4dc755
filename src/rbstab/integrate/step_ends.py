"""The ends of the steps of a run, which show its extrema and its settling between samples."""

from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

MOST = 20_000
"""Of a run with more steps nothing is kept: it would take more memory, and more time than it."""


class StepEnds:
    """The times, s, and the audited states at the ends of the steps of a run, in their order.

    Attributes:
        times: The first one is the start of the run. Two are equal where the state jumps.
        states: Only the states of the system: audit states may have a scale.
        systems: The smooth system of the step that ends there.
        complete: Whether all steps are here. Otherwise there is none.
    """

    def __init__(self) -> None:
        self.times: list[float] = []
        self.states: list[Array] = []
        self.systems: list[System] = []
        self.complete = True

    def add(self, t: float, y: Array, system: System) -> None:
        """Add the end of a step, or the state to which the last one has jumped.

        Args:
            t: The time, s.
            y: The audited state; it must not change later.
            system: The smooth system of the step.
        """
        if not self.complete:
            return
        if self.times and t == self.times[-1] and (y == self.states[-1]).all():
            return
        self.times.append(t)
        self.states.append(y)
        self.systems.append(system)
        if len(self.times) > MOST:
            self.times, self.states, self.systems, self.complete = [], [], [], False

    def until(self, t: float) -> "StepEnds":
        """Return the ends up to a time, s."""
        ends = StepEnds()
        ends.complete = self.complete
        count = sum(time <= t for time in self.times)
        ends.times, ends.states = self.times[:count], self.states[:count]
        ends.systems = self.systems[:count]
        return ends
