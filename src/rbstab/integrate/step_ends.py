"""The ends of the steps of a run, which show its extrema and its settling between samples."""

from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

MOST = 20_000
"""Of a run with more steps short ones are joined: all would take more memory, and more time than
the run."""

JOINED = 4
"""Then the ends are joined until this fraction of `MOST` would lie at even distances."""


class StepEnds:
    """The times, s, and the audited states at the ends of the steps of a run, in their order.

    Attributes:
        times: The first one is the start of the run. Two are equal where the state jumps.
        states: Only the states of the system: audit states may have a scale.
        systems: The smooth system of the step that ends there.
        whole: Whether the step that ends there begins at the end before; otherwise short steps are
            joined. They are shorter, together, than all but very few parts of the run.
        complete: Whether no steps are joined.
    """

    def __init__(self) -> None:
        self.times: list[float] = []
        self.states: list[Array] = []
        self.systems: list[System] = []
        self.whole: list[bool] = []
        self.complete = True
        self._distance = 0.0

    def add(self, t: float, y: Array, system: System, *, whole: bool = True) -> None:
        """Add the end of a step, or the state to which the last one has jumped.

        Args:
            t: The time, s.
            y: The audited state; it must not change later.
            system: The smooth system of the step.
            whole: Whether the step is one of the run.
        """
        if self.times and t == self.times[-1] and (y == self.states[-1]).all():
            return
        if len(self.times) > 1 and t - self.times[-2] < self._distance:
            whole = False
            for row in (self.times, self.states, self.systems, self.whole):
                row.pop()
        self.times.append(t)
        self.states.append(y)
        self.systems.append(system)
        self.whole.append(whole)
        if len(self.times) > MOST:
            self._join()

    def _join(self) -> None:
        rows = list(zip(self.times, self.states, self.systems, self.whole, strict=True))
        self._distance = JOINED * (self.times[-1] - self.times[0]) / MOST
        for row in (self.times, self.states, self.systems, self.whole):
            row.clear()
        for t, y, system, whole in rows:
            self.add(t, y, system, whole=whole)
        self.complete = False

    def until(self, t: float) -> "StepEnds":
        """Return the ends up to a time, s."""
        ends = StepEnds()
        ends.complete = self.complete
        count = sum(time <= t for time in self.times)
        ends.times, ends.states = self.times[:count], self.states[:count]
        ends.systems, ends.whole = self.systems[:count], self.whole[:count]
        return ends
