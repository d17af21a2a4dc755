"""What follows an event of a stop: an impact, a rest, or a release. It is the same for all engines.

The event function of a stop is the distance from it, as long as the body does not rest there. Where
it reaches zero, the state jumps (`systems.impact`), and the mode stays: the body bounces. If it
comes to rest, the mode becomes 1. The event function is then the acceleration towards the stop that
the couple of the stop prevents; where it falls to zero, the body is released.
"""

from typing import TYPE_CHECKING

import numpy as np

from rbstab.integrate.impact_trace import ImpactTrace
from rbstab.integrate.status import RunStatus
from rbstab.integrate.watched_rates import StopRun
from rbstab.mechanics.numbers import Array
from rbstab.systems.filippov import slide_modes
from rbstab.systems.impact import (
    HOP_HEIGHT,
    first_stop_mode,
    impact,
    laid_on_stop,
    rests,
    side_of,
    stop_of,
)
from rbstab.systems.system import System

if TYPE_CHECKING:
    from rbstab.integrate.switching.current_phase import CurrentPhase

PASSED = 1e-13
"""An impact has moved a margin past zero if it is below minus this. Smaller margins are round-off:
those of displacements do not jump."""

STORED_RESTS = 100_000
"""The rests that are stored with their times; there may be any number of them."""


class Impacts:
    """The impacts of one run against the stop of its system.

    Args:
        current: The phase of the run.
        system: Its system, which has a stop.

    Attributes:
        lost: The energy that the impacts have taken away so far, J.
        count: The number of impacts so far.
    """

    def __init__(self, current: "CurrentPhase", system: System) -> None:
        self._current = current
        first = first_stop_mode(system)
        self._sides = {first: 1, first + 1: -1}
        self._of_axes = frozenset(slide_modes(system).ravel().tolist())
        self.lost = 0.0
        self.count = 0
        self._times: list[float] = []
        self._rates: list[float] = []
        self._rests: list[tuple[float, float]] = []
        self._samples: list[tuple[int, float, int]] = []
        self._last = -np.inf

    @property
    def resting(self) -> int:
        """The side on which the body rests: 1 or -1; 0 if it does not."""
        signs = self._current.phase.signs
        return sum(side for mode, side in self._sides.items() if signs[mode] > 0)

    def begin(self, t: float, y: Array) -> Array:
        """Return the state after the start of the run, at which the body may touch its stop.

        Args:
            t: The time, s.
            y: The audited state at the start.

        Raises:
            StopRun: The start is beyond the stop.
        """
        system = self._current.phase.system
        side, stop = side_of(system, y), stop_of(system)
        assert stop is not None
        if self.resting:
            self._rests.append((t, np.nan))
            return laid_on_stop(system, y)
        if not side:
            return y
        if abs(y[1]) > stop.angle + HOP_HEIGHT:
            raise StopRun(RunStatus.SOLVER_FAILURE, f"θ2 starts beyond the stop {stop.name}")
        mode = next(mode for mode, of in self._sides.items() if of == side)
        if self._current.phase.margin_rates(y, t)[mode] < 0:
            return self.after([mode], t, y)
        return y

    def after(self, modes: list[int], t: float, y: Array) -> Array:
        """Switch modes at a time, and return the state after it.

        An impact can turn back what the motion was about to switch at the same time. So the other
        modes are those that switch after it.

        Args:
            modes: The modes whose margins have reached zero.
            t: The time, s.
            y: The audited state.

        Raises:
            StopRun: As `CurrentPhase.switch`.
        """
        current = self._current
        meets = [m for m in modes if m in self._sides and current.phase.signs[m] < 0]
        if not meets:
            rested = self.resting
            current.switch(modes, t)
            y = current.slide(modes, t, y)
            self._release(rested, t, y)
            return y
        if t == self._last:
            raise StopRun(RunStatus.SOLVER_FAILURE, "the hops at the stop became too short")
        found = impact(current.phase.system, y)
        current.count_impact()
        y, lost = found.state, float(found.lost)
        others = self._others(t, y)
        if others:
            current.switch(others, t)
        side = self._sides[meets[0]]
        if current.slides:
            y, discarded = self._slide(side, t, y)
            lost += discarded
        elif rests(current.phase.system, y, side, t):
            y, discarded = self._rest(meets[0], t, y)
            lost += discarded
        # Nothing is recorded if the run ends here, before the impact.
        self._last = t
        self.lost += lost
        self.count += 1
        self._times.append(t)
        self._rates.append(float(found.rate))
        return y

    def _others(self, t: float, y: Array) -> list[int]:
        """Return the modes that an impact switches, but for those of the stop and of sliding axes.

        They reach their switch at the same time, or the impact moves them past it: the velocities
        jump, and so does s = F + κE of a tie with a boundary layer.
        """
        phase = self._current.phase
        passed = np.flatnonzero(phase.margins(y, t) < -PASSED)
        found = {*phase.coinciding(y, t).tolist(), *passed.tolist()}
        return sorted(found - self._sides.keys() - self._of_axes)

    def _rest(self, mode: int, t: float, y: Array) -> tuple[Array, float]:
        """Return the state in which the body rests, and what is left of its hops, J."""
        before = self._current.phase.system.observe(y).energy.sum()
        self._current.switch([mode], t)
        system = self._current.phase.system
        y = laid_on_stop(system, y)
        self._begin_rest(t)
        return y, float(before - system.observe(y).energy.sum())

    def _slide(self, side: int, t: float, y: Array) -> tuple[Array, float]:
        """Return the state after the choice for axes that slide, and what it takes away, J."""
        current = self._current
        before = current.phase.system.observe(y, t).energy.sum()
        y = current.slide_after_impact(side, t, y)
        if self.resting:
            self._begin_rest(t)
        return y, float(before - current.phase.system.observe(y, t).energy.sum())

    def _begin_rest(self, t: float) -> None:
        if len(self._rests) < STORED_RESTS:
            self._rests.append((t, np.nan))

    def _end_rest(self, t: float) -> None:
        if self._rests:
            self._rests[-1] = self._rests[-1][0], t

    def after_breakpoint(self, t: float, y: Array) -> Array:
        """Return the state after a breakpoint of an input, where a body that rests may be released.

        Args:
            t: The time, s.
            y: The audited state.

        Raises:
            StopRun: As `CurrentPhase.slide`.
        """
        rested = self.resting
        y = self._current.slide([], t, y)
        self._release(rested, t, y)
        return y

    def _release(self, rested: int, t: float, y: Array) -> None:
        """Release a body that rests if its load has jumped, and store the end of its rest.

        A switch of another element can change the load, or a breakpoint of an input.

        Args:
            rested: The side on which it rested before, or 0.
            t: The time, s.
            y: The audited state.
        """
        side, current = self.resting, self._current
        if side:
            mode = next(mode for mode, of in self._sides.items() if of == side)
            if current.phase.margins(y, t)[mode] < 0:
                current.switch([mode], t)
        if rested and not self.resting:
            self._end_rest(t)

    def add_sample(self) -> None:
        """Store the impacts so far as those of a sample."""
        self._samples.append((self.count, self.lost, self.resting))

    def repeat_sample(self) -> None:
        """Store the last sample again, after a breakpoint at its time."""
        self._samples.pop()
        self.add_sample()

    def trace(self) -> ImpactTrace:
        """Return the impacts of the samples so far."""
        counts, lost, resting = zip(*self._samples, strict=True)
        return ImpactTrace(
            np.array(counts),
            np.array(lost),
            np.array(resting),
            np.array(self._times),
            np.array(self._rates),
            self._rests,
        )
