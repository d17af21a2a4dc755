"""The outcome of a run, and its derivative along one direction of the config.

The caller gives the direction as the same system and start with complex numbers, shifted by ih
along the direction. The imaginary parts of its parameters and of its start are h times the
direction. The imaginary parts of all results computed from them along the motion are h times their
derivatives, exact to round-off (see `derivatives.jacobian`). So the functions that build the system
also apply the chain rule from the config's quantities to the system's parameters. For example, the
mass also changes the weight and may change the anchor; this needs no formula here.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rbstab.analysis.approached_state import lyapunov_zero
from rbstab.analysis.rest_state import RestState, nearest_rest_state
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.analysis.settling import (
    SETTLED_FRACTION,
    ends_near_rest,
    settling_level,
    value_round_off,
)
from rbstab.integrate.heyoka.course import course_of
from rbstab.integrate.heyoka.variational import (
    TOLERANCE,
    Levels,
    Passage,
    Tangent,
    VariationalSystem,
    VariationalTrajectory,
    variational_system,
)
from rbstab.integrate.problem import Problem
from rbstab.integrate.status import RunStatus, UnfinishedRunError
from rbstab.integrate.switching.course import Course
from rbstab.integrate.switching.saltation import NotDifferentiableError
from rbstab.integrate.switching.trust import with_connector_by_modes
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.systems.impact import side_of, stop_of
from rbstab.systems.modes import modes_of, with_modes, with_modes_at
from rbstab.systems.schedule import schedule_of
from rbstab.systems.system import Observation, System


class Outcome(NamedTuple):
    """The outcome of a run, or the derivative of each field of an outcome.

    final is [Θ, Ω, X, V] and the connector's own state at the end, shape (12,) or (15,). peaks (m)
    are the values of E farthest from zero by axis, at peak_times (s), shape (3,). largest_distance
    (m) is the largest |E|. settling_time (s) is NaN if the run does not settle. lyapunov_integral
    (J s) is ∫v dt over the run, NaN if no rest state was found.
    """

    final: Array
    peaks: Array
    peak_times: Array
    largest_distance: float
    settling_time: float
    lyapunov_integral: float


class Shifted(NamedTuple):
    """The numbers of a problem, shifted: its system in any modes, its start, and its legs.

    legs has the legs of each input that is made of them, shape (legs, 3), by name.
    """

    system: System
    start: Array
    legs: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class Baseline:
    """A run, its systems, its rest state and its outcome.

    distance_time, s, is that of the largest |E|. value_time, s, is that of the value of v from
    which settling counts: of v(0), or of the largest v if elements supply power.
    """

    problem: Problem
    course: Course
    rest: RestState
    compiled: VariationalSystem
    outcome: Outcome
    distance_time: float
    value_time: float


def baseline(problem: Problem) -> Baseline:
    """Integrate a run and find its extremes, to round-off.

    Raises:
        UnfinishedRunError: The run did not complete.
        NotDifferentiableError: The motion is chaotic.
    """
    course, resting = course_of(problem, TOLERANCE), smooth_rest_system(problem)
    compiled = variational_system(course.first)
    span = problem.times[[0, -1]]
    nearest = nearest_rest_state(resting)
    zero = nearest.energy

    def run(times: Array, level: float = 0.0) -> VariationalTrajectory:
        solution = compiled.integrate(problem, course, times, Levels(zero, level))
        return completed(solution, problem)

    def value(system: System, y: Array) -> float:
        """Return the Lyapunov function v, J."""
        return float(system.observe(y).energy.sum() - zero)

    coarse = run(span)
    # v is zero at the rest state that the motion approaches.
    last = coarse.states[-1]
    element_states, moved = last[problem.system.coordinates.size :], problem.system.motion(last)
    rest = lyapunov_zero(resting, moved, element_states, nearest).rest
    zero = rest.energy
    values = {float(span[0]): value(course.first, problem.start)}
    if problem.system.supplies:
        solution = run(np.unique(np.concatenate([coarse.times, coarse.power_zeros])))
        pairs = zip(solution.times.tolist(), solution.states, strict=True)
        values = {t: value(course.system_at(t), y) for t, y in pairs}
        values |= {t: passage.energy - zero for t, passage in solution.passages.items()}
    largest_at = max(values, key=values.__getitem__)
    largest = values[largest_at]
    noise = float(value_round_off(lambda y: course.first.observe(y).energy, problem.start))
    level = float(settling_level(largest, noise))
    coarse = run(span, level)
    settling = np.nan
    ends, away = np.array([value(course.systems[-1], last)]), moved.Theta - rest.motion.Theta
    near = ends_near_rest(ends, np.array([abs(largest)]), away[None], np.array([noise]))[0]
    if rest.is_at_rest and near and ends[0] < level:
        # A motion that begins at rest has settled then.
        crossings = [*([span[0]] if largest < level else []), *coarse.crossings]
        settling = float(crossings[-1]) if crossings else np.nan
    impacts = [transition.time for transition in course.transitions if transition.impact]
    times = np.unique(np.concatenate([span, *coarse.turning_times, coarse.crossings, impacts]))
    trajectory = run(times)
    E = np.array([problem.system.motion(y).E for y in trajectory.states])
    distance = np.linalg.norm(E, axis=1)
    peaks, farthest = np.abs(E).argmax(axis=0), distance.argmax()
    outcome = Outcome(
        _final(problem.system.observe(trajectory.states[-1])),
        E[peaks, range(3)],
        times[peaks],
        float(distance[farthest]),
        settling,
        float(trajectory.lyapunov_integral[-1]) if rest.is_at_rest else np.nan,
    )
    return Baseline(problem, course, rest, compiled, outcome, float(times[farthest]), largest_at)


def derivative_along(base: Baseline, shifted: Shifted) -> Outcome:
    """Compute the derivative of a run's outcome along a direction.

    A peak of E at the time t changes by ∂E/∂s + F dt/ds. At a turning point F = 0, and t changes by
    -(∂F/∂s)/Ḟ. A peak at an impact moves with it, and a peak at an end of the run stays at that
    end. The settling time changes by -(∂v/∂s - 1e-3 ∂v(0)/∂s)/v'. If v falls below its fraction in
    an impact, it changes by dt/ds of this impact. v is zero at the rest state.
    The energy of the rest state is stationary, so its derivative is ∂/∂s at a fixed state. If two
    peaks are equally far from zero, the result is the derivative of the peak in `base`.

    Args:
        base: The run.
        shifted: Its numbers, shifted by ih along the direction, h = `derivatives.STEP`.

    Raises:
        UnfinishedRunError: The run did not complete.
        NotDifferentiableError: It has no derivative along the direction.
    """
    rest_energy = _rest_energy_derivative(base, shifted.system)
    tangent = tangent_along(base.problem, shifted, rest_energy)
    outcome, course = base.outcome, base.course
    begin, end = base.problem.times[[0, -1]].tolist()
    needed = [begin, end, *outcome.peak_times, base.distance_time, base.value_time]
    if not np.isnan(outcome.settling_time):
        needed.append(outcome.settling_time)
    times = np.unique(needed)
    trajectory = completed(
        base.compiled.integrate(base.problem, course, times, Levels(base.rest.energy), tangent),
        base.problem,
    )
    states = dict(zip(times.tolist(), trajectory.states, strict=True))
    seen = {
        t: tangent.like(course.system_at(t), t).observe(y + 1j * STEP * z, t)
        for (t, y), z in zip(states.items(), trajectory.tangents, strict=True)
    }
    passages = trajectory.passages
    impacts = {time: passage.delay for time, passage in passages.items() if passage.impact}
    peaks, peak_times = np.zeros((2, 3))
    for axis, t in enumerate(outcome.peak_times.tolist()):
        motion = seen[t].motion
        if begin < t < end:
            ahead = states[t] + 1j * STEP * course.system_at(t).rates(states[t], t)
            change = _derivative(base.problem.system.motion(ahead).F[axis])
            with np.errstate(all="ignore"):
                peak_times[axis] = impacts.get(t, -_derivative(motion.F[axis]) / change)
        peaks[axis] = _derivative(motion.E[axis]) + motion.F[axis].real * peak_times[axis]
    return Outcome(
        _derivative(_final(seen[end])),
        peaks,
        peak_times,
        _distance_derivative(base, impacts, seen[base.distance_time].motion),
        _settling_derivative(base, passages, seen, tangent.rest_energy),
        float(trajectory.lyapunov_integral_tangent[-1]),
    )


def _distance_derivative(base: Baseline, impacts: Mapping[float, float], motion: Motion) -> float:
    """Return E'(∂E/∂s + F dt/ds) / |E|."""
    distance, E = base.outcome.largest_distance, motion.E
    # t moves with an impact. Elsewhere E'F = 0, or t is an end of the run and stays there.
    change = _derivative(E) + motion.F.real * impacts.get(base.distance_time, 0.0)
    return float(E.real @ change) / distance if distance > 0 else 0.0


def _settling_derivative(
    base: Baseline,
    passages: Mapping[float, Passage],
    seen: Mapping[float, Observation],
    rest_slope: float,
) -> float:
    time, largest_at = base.outcome.settling_time, base.value_time
    # A motion that begins at rest has no derivative: any change of its start delays it at once.
    if np.isnan(time) or time == base.problem.times[0]:
        return np.nan
    if time in passages and passages[time].impact:
        return passages[time].delay
    if largest_at in passages:
        largest_slope = passages[largest_at].energy_slope
    else:
        largest_slope = float(_derivative(seen[largest_at].energy.sum()))
    if np.isnan(largest_slope):
        raise NotDifferentiableError(
            f"elements: v is largest at t = {largest_at:.9g} s, where several inputs change, so "
            "that the settling time has no derivatives (expected changes one after another)"
        )
    settling = seen[time]
    level = SETTLED_FRACTION * (largest_slope - rest_slope)
    excess = _derivative(settling.energy.sum()) - rest_slope - level
    with np.errstate(all="ignore"):
        power = (settling.supplied.sum() - settling.dissipation.sum()).real
        return float(-excess / np.float64(power))


def _rest_energy_derivative(base: Baseline, shifted: System) -> float:
    """Return the derivative of the energy of the rest state: the partial one at a fixed state."""
    resting = smooth_rest_system(base.problem)
    state = resting.start(base.rest.motion, base.rest.element_states)
    modes = modes_of(with_modes_at(resting, state))
    shifted = with_modes(smooth_rest_system(replace(base.problem, system=shifted)), modes)
    stop, side = stop_of(shifted), side_of(resting, state)
    # If the body rests against its stop, θ2 moves with the stop.
    if stop is not None and side:
        state = np.concatenate([state[:PITCH], [side * stop.angle], state[PITCH + 1 :]])
    return float(_derivative(shifted.potential_energy(state)))


def tangent_along(problem: Problem, shifted: Shifted, rest_energy: float = 0.0) -> Tangent:
    """Return the direction of a derivative.

    Args:
        problem: The problem of the run.
        shifted: Its numbers, as for `derivative_along`.
        rest_energy: The derivative of the energy of the rest state, J, of use for ∫v dt only.
    """
    system = _by_modes(problem, shifted.system)
    return Tangent(system, _derivative(shifted.start), rest_energy, schedule_of(shifted.legs))


def _by_modes(problem: Problem, system: System) -> System:
    """Return a system like that of a problem, whose sliding connector has modes 0 and 1."""
    if problem.switching is None:
        return system
    return with_connector_by_modes(replace(problem, system=system))


def _final(observation: Observation) -> Array:
    motion = observation.motion
    parts = (motion.Theta, motion.Omega, motion.X, motion.V, observation.own_states)
    return np.concatenate(parts)


def _derivative(value: Array) -> Array:
    return np.imag(value) / STEP


def completed(trajectory: VariationalTrajectory, problem: Problem) -> VariationalTrajectory:
    """Return the trajectory of a run that completed.

    Raises:
        UnfinishedRunError: It did not.
        NotDifferentiableError: It passes θ2 = ±90°.
    """
    if problem.quaternion and trajectory.status is RunStatus.RANGE_LEFT:
        raise NotDifferentiableError(
            "the motion passes θ2 = ±90°, and derivatives are found in Euler angles only"
        )
    if trajectory.status is not RunStatus.COMPLETED:
        raise UnfinishedRunError(trajectory.status, trajectory.detail)
    return trajectory
