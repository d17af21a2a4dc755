"""The peaks of a member that is integrated as a single run."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np

from rbstab.analysis.peak_search import (
    RELATIVE,
    STEPS_PER_INTERVAL,
    Peaks,
    Samples,
    find_peaks,
    peaks_of_cubics,
)
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.engines import engine
from rbstab.integrate.problem import Problem, Trajectory
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.sweep.members.outcome import THETA_ROWS
from rbstab.sweep.members.refinement import MAX_SAMPLES, PARTS, refined, refinements
from rbstab.systems.impact import stop_of
from rbstab.systems.system import System

STEPS_OF_SLIDING = 2
"""As `STEPS_PER_INTERVAL`, for Taylor steps of a sliding member: a step ends at each sample and at
each switch."""

SAME_END = 1e-6
"""If a motion that is integrated again from a sample misses the next sample by more than this times
the state, it is another motion: the chatter of a sliding connector is not repeatable."""


class SinglePeaks:
    """The search for the peaks of one single run.

    Args:
        problem: The problem.
        engine_name: The name of the engine.
        deadline: The deadline of the run. What is not found in time has an unknown error.
    """

    def __init__(self, problem: Problem, engine_name: str, deadline: Deadline) -> None:
        self.problem = replace(problem, diagnosed=False)
        self.engine = engine_name
        self.deadline = deadline
        self._integrate = engine(engine_name)
        # Nothing of these motions is recorded.
        deadline.recording_time = 0.0

    def find(self, trajectory: Trajectory, given: Samples) -> Peaks:
        """Return the peaks of a trajectory, each of shape (6, 1).

        Args:
            trajectory: The trajectory.
            given: The samples of E and Θ along it, without `divide`.
        """
        tolerance = max(self.problem.rtol, RELATIVE)
        times, states = trajectory.times, trajectory.states
        steps_per_interval = STEPS_PER_INTERVAL[self.engine]
        if self.problem.switching is not None:
            steps_per_interval = max(steps_per_interval, STEPS_OF_SLIDING)
        steps = np.array([trajectory.steps // steps_per_interval])
        parts = int(refinements(steps, len(times), MAX_SAMPLES)[0])
        cubics = peaks_of_cubics(given)
        too_fast = bool(steps[0] > parts * (len(times) - 1))
        is_unknown = parts > 1 or too_fast
        if parts > 1 and self.problem.switching is None:
            fine = refined(times, parts)
            again = self.integrate(fine, self.problem.start)
            if len(again.times) == len(fine) and (again.times == fine).all():
                is_unknown, states = too_fast, again.states
                given = self._samples(fine[np.newaxis], states[np.newaxis])._replace(times=fine)
        divide = self._divider(given.times[np.newaxis], states[np.newaxis])
        found = find_peaks(given._replace(divide=divide), tolerance, cubics)
        found = _at_stop(found, trajectory)
        return found._replace(error=np.full_like(found.error, np.nan)) if is_unknown else found

    def integrate(self, times: Array, start: Array) -> Trajectory:
        """Return the motion from a state, sampled at some times."""
        problem = replace(self.problem, start=start, times=times)
        return self._integrate(problem, None, self.deadline)

    def _divider(self, times: Array, states: Array) -> Callable[[Array, Array], Samples]:
        """Return the function `divide` of samples.

        Args:
            times: Shape (m, n), s.
            states: Shape (m, n, size).
        """

        def divide(members: Array, intervals: Array) -> Samples:
            begin, end = times[members, intervals], times[members, intervals + 1]
            finer = np.linspace(begin, end, PARTS + 1, axis=1)
            parts = [
                self._between(finer[row], states[member, interval], states[member, interval + 1])
                for row, (member, interval) in enumerate(zip(members, intervals, strict=True))
            ]
            return self._samples(finer, np.array(parts))

        return divide

    def _between(self, times: Array, start: Array, end: Array) -> Array:
        """Return the states at times between two samples; NaN if they cannot be computed."""
        unknown = np.full((len(times), len(start)), np.nan)
        if self.deadline.remaining() < 0:
            return unknown
        found = self.integrate(times, start)
        if len(found.times) != len(times) or found.times[-1] != times[-1]:
            return unknown
        missed = np.abs(found.states[-1] - end).max()
        return found.states if missed <= SAME_END * max(1.0, np.abs(end).max()) else unknown

    def _samples(self, times: Array, states: Array) -> Samples:
        """Return the samples of E and Θ at states of shape (m, n, size)."""
        shape = states.shape[:2]
        observe = self._values_and_rates
        found = np.array([observe(state) for state in states.reshape(-1, states.shape[2])])
        values, rates = np.moveaxis(found, 0, -1).reshape(2, 6, *shape)
        return Samples(times, values, rates, self._divider(times, states))

    @cached_property
    def _values_and_rates(self) -> StraightLine:
        """E and Θ, and then their rates, as a function of the state, shape (12,)."""
        return StraightLine(_values_and_rates_at, self.problem.system, len(self.problem.start))


def _values_and_rates_at(system: System, state: Array) -> Array:
    motion = system.motion(state)
    return np.concatenate([motion.E, motion.Theta, motion.F, motion.B @ motion.Omega])


def _at_stop(found: Peaks, trajectory: Trajectory) -> Peaks:
    """Return peaks in which θ2 is that of its stop, where the motion meets it.

    θ2 has a corner there, which no interpolant follows.
    """
    impacts = trajectory.impacts
    if impacts is None or not (len(impacts.times) or impacts.resting.any()):
        return found
    if impacts.resting[0]:
        side, time = float(impacts.resting[0]), float(trajectory.times[0])
    else:
        side, time = float(np.sign(impacts.rates[0])), float(impacts.times[0])
    stop = stop_of(trajectory.systems[0])
    assert stop is not None
    value, at, error = (array.copy() for array in found)
    row = THETA_ROWS.start + PITCH
    value[row], at[row], error[row] = side * stop.angle, time, 0.0
    return Peaks(value, at, error)
