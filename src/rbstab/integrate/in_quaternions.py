"""Integration of a quaternion in place of Θ: problems and trajectories have Θ, the engine has q.

So a motion may pass θ2 = ±90°, and nothing else need know of it. θ1 and θ3 are continued from the
start, along samples and ends of steps. Where these do not tell the turns, the same motion is
sampled finer.
"""

import math
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
        steps: The most steps between two samples that show how the body turns, if the ends of the
            steps are not known.
    """

    def __init__(self, engine: Engine, steps: int) -> None:
        self.engine, self.steps = engine, steps

    def __call__(
        self,
        problem: Problem,
        progress: Progress | None = None,
        deadline: Deadline | None = None,
    ) -> Trajectory:
        """Integrate a problem (an `Engine`).

        Args:
            problem: The problem.
            progress: As `Engine`.
            deadline: As `Engine`.
        """
        if not problem.quaternion:
            return self.engine(problem, progress, deadline)
        deadline = deadline or Deadline(problem.time_limit)
        system, q = in_quaternions(problem.system)
        start = q.from_angles(problem.start)
        inner = replace(problem, system=system, start=start, range_bound=NEVER, quaternion=False)
        trajectory = self.engine(inner, progress, deadline)
        Theta, turn, told = _angles_along(q, trajectory, problem.start[THETA])
        steps = 0 if told else trajectory.steps / self.steps
        parts = _parts_needed(turn, steps, trajectory)
        states = q.to_angles(trajectory.states.T, Theta)
        outer = {
            inner_system: replace(inner_system, coordinates=q.angles)
            for inner_system in set(trajectory.systems)
        }
        trajectory = replace(
            trajectory,
            states=np.ascontiguousarray(states.T),
            systems=tuple(outer[inner_system] for inner_system in trajectory.systems),
        )
        return trajectory if parts == 1 else self._with_turns(problem, trajectory, parts, deadline)

    def _with_turns(
        self, problem: Problem, trajectory: Trajectory, parts: int, deadline: Deadline
    ) -> Trajectory:
        """Return a trajectory with the turns of finer samples, as far as there are any in time."""
        times, recording = trajectory.times, deadline.recording_time
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
        states = trajectory.states.copy()
        states[:, THETA] = same_turns(states[:, THETA].T, finer.states[rows, THETA].T).T
        trajectory = replace(trajectory, states=states)
        return (
            trajectory
            if reached.all()
            else first_samples(trajectory, int(reached.argmin()), deadline)
        )


def in_quaternions(system: System) -> tuple[System, QuaternionCoordinates]:
    """Return a system with a quaternion in place of Θ, and its coordinates."""
    angles: Any = system.coordinates
    q = QuaternionCoordinates(angles)
    return replace(system, coordinates=q), q


def _angles_along(
    q: QuaternionCoordinates, trajectory: Trajectory, start: Array
) -> tuple[Array, float, bool]:
    """Return Θ at samples, the largest turn in doubt, rad, and whether the ends of steps tell."""
    count, ends = len(trajectory.times), trajectory.ends
    states, times = trajectory.states.T, trajectory.times
    told = ends is not None and ends.complete and len(ends.times) > 1
    if ends is not None and told:
        states = np.concatenate([states[: q.size], np.array(ends.states).T[: q.size]], axis=1)
        times = np.append(times, ends.times)
    alone = np.zeros(len(times), dtype=int)
    Theta, turns = q.angles_along(states, times, start[:, np.newaxis], alone)
    return Theta[:, :count], float(turns[0]), told


def _parts_needed(turn: float, intervals: float, trajectory: Trajectory) -> int:
    """Return how many parts of each interval of a motion are needed to show how it turns."""
    # `turn` is the largest turn in doubt, rad; `intervals` are the fewest that show it.
    samples = max(len(trajectory.times) - 1, 1)
    needed = max(turn / LONGEST_TURN, intervals / samples)
    enough = max(INTERVALS_PER_STEP * max(trajectory.steps, 1) / samples, 1.0)
    # A turn that is no number needs none.
    parts = min(needed, enough) if needed > 1.0 else 1.0
    return 2 ** math.ceil(math.log2(parts))


def refined(times: Array, parts: int) -> Array:
    """Return times with each interval divided into parts; those of the samples stay the same."""
    places = np.arange(parts * (len(times) - 1) + 1) / parts
    return np.interp(places, np.arange(len(times)), times)
