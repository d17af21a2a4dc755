"""The samples of a run of the compiled engine in which modes switch."""

from bisect import bisect_right
from typing import Any

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem
from rbstab.integrate.switching.current_phase import CurrentPhase, SoFar
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

IN_BLOCK = 100
"""This many samples are made between two looks at the deadline: one step may have thousands."""


class ModeSamples:
    """The samples of one run, each with the smooth system at its time.

    Args:
        problem: The problem.
        current: The current phase of the run.
        deadline: The deadline of the run.

    Attributes:
        rows: The time, s, and the audited state of each sample, with audit states as the integrator
            scales them.
        systems: The system at each sample.
    """

    def __init__(self, problem: Problem, current: CurrentPhase, deadline: Deadline) -> None:
        self._current, self._deadline = current, deadline
        self._times = problem.times.tolist()
        # The system would count the states of its elements again at each sample.
        self._size = problem.system.size
        self.rows: list[tuple[float, Array]] = []
        self.systems: list[System] = []

    @property
    def last_time(self) -> float:
        """The time of the last sample, s."""
        return self.rows[-1][0]

    @property
    def are_complete(self) -> bool:
        """Whether all samples are there."""
        return len(self.rows) == len(self._times)

    def lacks(self, time: float) -> bool:
        """Return whether a sample up to a time, s, is not there yet."""
        count = len(self.rows)
        return count < len(self._times) and self._times[count] <= time

    def add(self, t: float, state: Array) -> None:
        """Add a sample of the current phase."""
        self._add([t], [state], self._current.so_far())

    def add_passed(self, integrator: Any, before: SoFar | None) -> None:
        """Add the samples within the last step, all of one phase: that before its last switch.

        At the deadline, the rest of them is left out.

        Args:
            integrator: heyoka's integrator, at the end of the step.
            before: What the samples store, if a mode has switched at the end of the step.
        """
        if not self.lacks(integrator.time):
            return
        so_far = before or self._current.so_far()
        while self.lacks(integrator.time):
            begin = len(self.rows)
            last = min(begin + IN_BLOCK, len(self._times))
            times = self._times[begin : bisect_right(self._times, integrator.time, begin, last)]
            states = [integrator.update_d_output(t).copy() for t in times]
            phase = self._current.phase
            if phase.rests:
                states = [phase.on_stop(state) for state in states]
            self._add(times, states, so_far)
            if self.lacks(integrator.time) and self._deadline.expired():
                return

    def begin_leg(self, t: float) -> None:
        """Give a sample at a breakpoint the modes of the leg that begins there, at a time, s."""
        if self.last_time == t:
            self.systems[-1] = self._current.phase.system
            self._current.repeat_sample(self.rows[-1][1])

    def in_joules(self, scale: float) -> list[tuple[float, Array]]:
        """Return the samples with their audit states in joules, from the energy scale, J."""
        states = np.array([state for _, state in self.rows])
        states[:, self._size :] *= scale
        return [(t, state) for (t, _), state in zip(self.rows, states, strict=True)]

    def _add(self, times: list[float], states: list[Array], so_far: SoFar) -> None:
        self.rows += zip(times, states, strict=True)
        self.systems += [so_far.system] * len(times)
        self._current.add_samples(states, so_far)
        self._deadline.samples = len(self.rows)
