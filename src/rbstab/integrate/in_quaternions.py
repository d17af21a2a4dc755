"""Integration of a quaternion in place of Θ: problems and trajectories have Θ, the engine has q.

So a motion may pass θ2 = ±90°, and nothing else need know of it. θ1 and θ3 are continued from the
start. Where samples are too far apart to tell the turns, the same motion is sampled finer.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Engine, Problem, Progress, Trajectory, first_samples
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.quaternion import same_turns
from rbstab.mechanics.states import THETA
from rbstab.systems.coordinates import QuaternionCoordinates
from rbstab.systems.system import System

LONGEST_TURN = 0.5
"""rad: where the way of the angles is in doubt, the body turns by at most this between two samples.
Then the doubt is where cos θ2 is below 1e-4, and Euler angles are hardly integrated."""

INTERVALS_PER_STEP = 64
"""A motion that seems to need more intervals than this for each step diverges."""

NEVER = -1.0
"""No run ends at this bound: the cosine of r_2, which is in the place of θ2, is larger."""


class InQuaternions:
    """An engine that integrates the problems with `quaternion` in quaternions (an `Engine`).

    Args:
        engine: The engine.
        steps: The most steps between two samples that show how the body turns.
    """

    def __init__(self, engine: Engine, steps: int) -> None:
        self.engine, self.steps = engine, steps

    def __call__(
        self,
        problem: Problem,
        progress: Progress | None = None,
        deadline: Deadline | None = None,
    ) -> Trajectory:
        """Integrate a problem (see `Engine`)."""
        if not problem.quaternion:
            return self.engine(problem, progress, deadline)
        deadline = deadline or Deadline(problem.time_limit)
        system, q = in_quaternions(problem.system)
        start = q.from_angles(problem.start)
        inner = replace(problem, system=system, start=start, range_bound=NEVER, quaternion=False)
        found = self.engine(inner, progress, deadline)
        states, turn = q.to_angles(found.states.T, found.times, problem.start[THETA])
        parts = int(parts_needed(turn, np.array(found.steps), len(found.times), self.steps))
        outer = {one: replace(one, coordinates=q.angles) for one in set(found.systems)}
        found = replace(
            found,
            states=np.ascontiguousarray(states.T),
            systems=tuple(outer[one] for one in found.systems),
        )
        return found if parts == 1 else self._with_turns(problem, found, parts, deadline)

    def _with_turns(
        self, problem: Problem, found: Trajectory, parts: int, deadline: Deadline
    ) -> Trajectory:
        """Return a trajectory with the turns of finer samples, as far as there are any in time."""
        times, recording = found.times, deadline.recording_time
        # Nothing of the finer samples is recorded.
        deadline.recording_time = 0.0
        fine = refined(times, parts)
        limit = problem.step_limit + len(fine)  # SciPy ends a step on each of them
        finer = self(
            replace(problem, times=fine, step_limit=limit, diagnosed=False), None, deadline
        )
        deadline.recording_time = recording
        # A run that stopped early may stop a rounding error earlier now.
        rows = np.minimum(parts * np.arange(len(times)), len(finer.times) - 1)
        reached = np.isclose(finer.times[rows], times, rtol=1e-9, atol=0.0)
        states = found.states.copy()
        states[:, THETA] = same_turns(states[:, THETA].T, finer.states[rows, THETA].T).T
        found = replace(found, states=states)
        return found if reached.all() else first_samples(found, int(reached.argmin()), deadline)


def in_quaternions(system: System) -> tuple[System, QuaternionCoordinates]:
    """Return a system with a quaternion in place of Θ, and its coordinates."""
    angles: Any = system.coordinates
    q = QuaternionCoordinates(angles)
    return replace(system, coordinates=q), q


def parts_needed(turns: Array, steps: Array, samples: int, most: int) -> Array:
    """Return into how many parts the intervals of motions must be divided to show how they turn.

    Args:
        turns: The largest turns in doubt of motions, any shape, rad.
        steps: The steps of the engine, in the same shape.
        samples: The number of samples.
        most: The most steps between two samples.
    """
    intervals = max(samples - 1, 1)
    needed = np.maximum(turns / LONGEST_TURN, steps / (most * intervals))
    enough = INTERVALS_PER_STEP * np.maximum(steps, 1) / intervals
    parts = np.minimum(np.where(needed > 1.0, needed, 1.0), np.maximum(enough, 1.0))
    return np.asarray(np.exp2(np.ceil(np.log2(parts))))


def refined(times: Array, parts: int) -> Array:
    """Return times with each interval divided into parts; those of the samples stay the same."""
    places = np.arange(parts * (len(times) - 1) + 1) / parts
    return np.interp(places, np.arange(len(times)), times)
