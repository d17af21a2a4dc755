"""What a run is judged by, and its derivative along one direction of the config.

The direction comes as the same problem with complex numbers, moved by ih along it: the imaginary
parts of its parameters and its start are the direction itself, and those of what is computed from
them along the motion are the derivatives, exact to round-off (see `derivatives.jacobian`). The
chain rule from the config's quantities to the system's parameters is so carried out by the
functions that build the system: a mass that is also a weight and shifts an anchor needs no formula.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.analysis.rest_state import RestState, nearest_rest_state
from rbstab.integrate.heyoka.variational import (
    Course,
    Tangent,
    VariationalSystem,
    variational_system,
)
from rbstab.integrate.problem import Problem
from rbstab.integrate.status import RunStatus, UnfinishedRunError
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array, Number
from rbstab.systems.parameters import parameters
from rbstab.systems.system import Observation, System

SETTLED_PART = 1e-3
"""A run has settled when its Lyapunov function has fallen below this part of v(0) for good."""


class Outcome(NamedTuple):
    """What a run is judged by; or the derivative of each of these.

    final is [Θ, Ω, X, V] and the connector's own state at the end, shape (12,) or (15,); peaks (m)
    are the values of E farthest from zero by axis, at peak_times (s), shape (3,); largest_distance
    (m) is the largest |E|; settling_time (s) is NaN where the run does not settle;
    lyapunov_integral is ∫v dt over the run, J s, NaN where there is no rest state to count v from.
    """

    final: Array
    peaks: Array
    peak_times: Array
    largest_distance: float
    settling_time: float
    lyapunov_integral: float


@dataclass(frozen=True, eq=False)
class Baseline:
    """A run, its rest state, and where it takes its extremes.

    milestones are the times of the peak of each axis and of the largest |E|, of settling (the end
    where there is none), and the end itself, shape (6,), s. interior tells of the three peaks
    whether they are turning points, not the ends of the run.
    """

    problem: Problem
    rest: RestState
    compiled: VariationalSystem
    milestones: Array
    interior: Array
    start_value: float
    outcome: Outcome


def baseline(problem: Problem) -> Baseline:
    """Follows a run and finds its extremes, to round-off.

    Raises:
        UnfinishedRunError: The run did not complete.
    """
    compiled, rest = variational_system(problem.system), nearest_rest_state(problem.system)
    value = _value(problem.system, problem.start, rest.energy)
    span = np.array([problem.times[0], problem.times[-1]])
    sketch = _completed(compiled.follow(problem, span, rest.energy, SETTLED_PART * value))
    times = np.unique(np.concatenate([span, *sketch.turnings, sketch.crossings]))
    course = _completed(compiled.follow(problem, times, rest.energy))
    E = np.array([problem.system.motion(y).E for y in course.states])
    sizes = np.column_stack([np.abs(E), np.linalg.norm(E, axis=1)])
    peaks = np.argmax(sizes, axis=0)
    settling = _settling_time(problem, rest, sketch, value)
    end = span[-1]
    milestones = np.array([*times[peaks], end if np.isnan(settling) else settling, end])
    interior = (times[peaks[:3]] > span[0]) & (times[peaks[:3]] < end)
    outcome = Outcome(
        _final(problem.system.observe(course.states[-1])),
        E[peaks[:3], range(3)],
        times[peaks[:3]],
        float(sizes[peaks[3], 3]),
        settling,
        float(course.lyapunov_integral[-1]) if rest.found else np.nan,
    )
    return Baseline(problem, rest, compiled, milestones, interior, value, outcome)


def _settling_time(problem: Problem, rest: RestState, course: Course, value: float) -> float:
    """The last time at which v falls below its part of v(0); NaN where it ends above it."""
    end = _value(problem.system, course.states[-1], rest.energy)
    settled = rest.found and len(course.crossings) > 0 and end < SETTLED_PART * value
    return float(course.crossings[-1]) if settled else np.nan


def derivative_along(base: Baseline, moved: Problem) -> Outcome:
    """The derivative of a run's outcome along a direction.

    At a turning point dE/dt = 0, so the derivative of a peak is that of E at a fixed time (envelope
    theorem), and its time moves by -(∂F/∂s)/Ḟ; a peak at an end of the run stays there. The
    settling time moves by -(∂v/∂s - 1e-3 ∂v(0)/∂s)/v'. v is counted from the rest state, whose
    energy is stationary, so that this too moves by ∂/∂s at a fixed state. Where two peaks are
    equally far from zero the derivative is that of the one found.

    Args:
        base: The run.
        moved: The same problem, moved by ih along the direction, h = `derivatives.STEP`.

    Raises:
        UnfinishedRunError: The run did not complete.
    """
    tangent = Tangent(
        np.concatenate([_slope(np.ravel(value)) for value in parameters(moved.system).values()]),
        _slope(moved.start),
        _rest_slope(base, moved.system),
    )
    times, order = np.unique(np.append(base.milestones, base.problem.times[0]), return_inverse=True)
    course = _completed(base.compiled.follow(base.problem, times, base.rest.energy, 0.0, tangent))
    states = course.states + 1j * STEP * course.tangents
    seen = [moved.system.observe(y) for y in states]
    at = [seen[index] for index in order]
    return Outcome(
        _slope(_final(at[5])),
        np.array([_slope(at[axis].motion.E[axis]) for axis in range(3)]),
        _peak_time_slopes(base, course.states[order], at),
        _distance_slope(base, at[3].motion.E),
        _settling_slope(base, moved, at[4], tangent.rest_energy),
        float(course.lyapunov_integral_tangent[-1]),
    )


def _peak_time_slopes(base: Baseline, states: Array, at: list[Observation]) -> Array:
    """-(∂F/∂s)/Ḟ of each axis at its turning point; 0 at an end of the run."""
    slopes = np.zeros(3)
    for axis in np.flatnonzero(base.interior):
        rates = base.problem.system.rates(states[axis])
        ahead = base.problem.system.motion(states[axis] + 1j * STEP * rates)
        with np.errstate(all="ignore"):
            slopes[axis] = -_slope(at[axis].motion.F[axis]) / _slope(ahead.F[axis])
    return slopes


def _distance_slope(base: Baseline, E: Array) -> float:
    """E'(∂E/∂s) / |E|."""
    distance = base.outcome.largest_distance
    return float(E.real @ _slope(E)) / distance if distance > 0 else 0.0


def _settling_slope(base: Baseline, moved: Problem, at: Observation, rest_slope: float) -> float:
    if np.isnan(base.outcome.settling_time):
        return np.nan
    excess = _slope(at.energy.sum()) - rest_slope
    excess_at_start = _slope(_value(moved.system, moved.start, base.rest.energy)) - rest_slope
    rate = -at.dissipation.sum().real
    with np.errstate(all="ignore"):
        return float(-(excess - SETTLED_PART * excess_at_start) / np.float64(rate))


def _rest_slope(base: Baseline, moved: System) -> float:
    state = base.problem.system.start(base.rest.motion, base.rest.own)
    return float(_slope(moved.potential_energy(state)))


def _value(system: System, y: Array, rest_energy: float) -> Number:
    """The Lyapunov function v, J."""
    return system.observe(y).energy.sum() - rest_energy


def _final(seen: Observation) -> Array:
    motion = seen.motion
    parts = (motion.Theta, motion.Omega, motion.X, motion.V, seen.connector_state)
    return np.concatenate(parts)


def _slope(value: Array) -> Array:
    return np.imag(value) / STEP


def _completed(course: Course) -> Course:
    if course.status is not RunStatus.COMPLETED:
        raise UnfinishedRunError(course.status, course.detail)
    return course
