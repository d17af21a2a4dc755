"""The extrema of a single run and when it settles, from the ends of its steps."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rbstab.analysis.extrema import (
    ABSOLUTE,
    Crossings,
    Extrema,
    Steps,
    Watch,
    along,
    farthest_from_zero,
    last_above,
    sampled_steps,
)
from rbstab.analysis.lyapunov import has_no_potential
from rbstab.analysis.settling import settling_times
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.in_quaternions import LONGEST_TURN
from rbstab.integrate.problem import Problem, Trajectory
from rbstab.integrate.step_ends import StepEnds
from rbstab.integrate.straight_line.equations import StraightLine, audited_rates_of
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.attitude import half_sine_squared, tilt
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.quaternion import beyond_ends
from rbstab.mechanics.states import OMEGA, PITCH, THETA
from rbstab.systems.coordinates import QuaternionCoordinates
from rbstab.systems.impact import stop_of
from rbstab.systems.quantities import BY_NAME, PEAKS, total_energy, values_of
from rbstab.systems.system import Observation, System

ROWS = {name: slice(3 * number, 3 * number + 3) for number, name in enumerate(PEAKS)}
"""The rows of each quantity with peaks among what is watched."""

E_ROWS, THETA_ROWS = ROWS["contact_displacement"], ROWS["orientation"]
SQUARE, TURN, VALUE = (3 * len(ROWS) + row for row in range(3))
"""The rows after them: |E|², m²; sin²(φ/2) of the tilt φ from Θ = 0; and v, J."""

SETTLED_DISTANCE = 1e-3
"""The contact point has settled when |E| stays below this distance, m."""

FINEST = 1e-12
"""The relative tolerance of the parts of a step that is divided."""

PARTS_IN_QUATERNIONS = 64
"""So many parts of a step show θ1 and θ3 near θ2 = ±90°."""

MOST_PARTS = 200
"""A step is not divided into more parts: it is one of stiff equations."""


class Extremes(NamedTuple):
    """The extrema of m motions, and when they settle.

    Attributes:
        extrema: Those of what is watched, shape (q, m). An error is NaN if only samples are known.
        settling: From when v is small, see `settling_times`.
        displacement_settling: From when |E| < `SETTLED_DISTANCE`.
    """

    extrema: Extrema
    settling: Crossings
    displacement_settling: Crossings


def extremes_of(
    problem: Problem,
    trajectory: Trajectory,
    quantities: Mapping[str, Array],
    deadline: Deadline | None,
) -> Extremes:
    """Return the extremes of a run; those of its samples if its steps are not known.

    Args:
        problem: The problem.
        trajectory: Its trajectory.
        quantities: Its recorded quantities.
        deadline: The deadline of the run; None for no limit.
    """
    ends, steps, turn = trajectory.ends, None, 0.0
    joined = np.empty(0, dtype=bool)
    # Where a body in quaternions turns past θ2 = ±90°, only whole steps tell how.
    if ends is not None and len(ends.times) > 1 and (ends.complete or not problem.quaternion):
        rest = float(quantities["energy_at_rest"])
        steps_of_run = _StepsOfRun(ends, rest, deadline, problem.start[THETA])
        steps, turn, joined = steps_of_run.steps(), steps_of_run.turn, steps_of_run.joined
    if steps is None:
        v = quantities["lyapunov"]
        if has_no_potential(problem.system):
            v = v + quantities["contact_work"]
        return extremes_of_samples(quantities, v)
    extremes = _extremes(steps, quantities)
    if joined.any():
        extremes = _with_joined(extremes, steps, joined)
    if problem.quaternion:
        extrema = pitch_of_sine(extremes.extrema)
        if turn > LONGEST_TURN:
            # The steps do not tell how the body turns.
            for rows in (extrema.value, extrema.error):
                rows[THETA_ROWS][::2] = np.nan
        extremes = extremes._replace(extrema=extrema)
    stop = stop_of(problem.system)
    if stop is not None:
        # An impact is at the stop but for round-off.
        pitch = extremes.extrema.value[THETA_ROWS.start + PITCH]
        np.clip(pitch, -stop.angle, stop.angle, out=pitch)
    return extremes


def _with_joined(extremes: Extremes, steps: Steps, joined: Array) -> Extremes:
    """Return extremes with errors for joined steps: within them the motion is not known."""

    def widened(crossings: Crossings) -> Crossings:
        place = np.maximum(np.searchsorted(steps.begin, crossings.time) - 1, 0)
        length = np.where(joined[place] & (crossings.time > 0), steps.length[place], 0.0)
        return crossings._replace(error=np.maximum(crossings.error, length))

    return Extremes(
        extremes.extrema._replace(error=np.full_like(extremes.extrema.error, np.nan)),
        widened(extremes.settling),
        widened(extremes.displacement_settling),
    )


def extremes_of_samples(quantities: Mapping[str, Array], v: Array) -> Extremes:
    """Return the extremes of the samples of a run. The errors of its extrema are not known.

    Args:
        quantities: Its recorded quantities.
        v: The Lyapunov function, shape (n,), J.
    """
    E, times = quantities["contact_displacement"], quantities["time"]
    peaks = [row for name in PEAKS for row in quantities[name].T]
    turn = np.sin(0.5 * tilt(quantities["orientation"], ZERO)) ** 2
    values = np.array([*peaks, (E * E).sum(axis=1), turn, v])
    if len(times) == 1:
        # Nothing is missed beside a single sample, and it does not show whether it stays there.
        extrema = Extrema(values, np.full_like(values, times[0]), np.zeros_like(values))
        unknown = Crossings(*np.full((2, 1), np.nan))
        return Extremes(extrema, unknown, unknown)
    extremes = _extremes(sampled_steps(times, values), quantities)
    lengths = np.append(np.diff(times), 0.0)
    after = [np.searchsorted(times, crossing.time) for crossing in extremes[1:]]
    # A crossing is somewhere between two samples.
    settling, near = (
        Crossings(crossing.time, np.where(crossing.time > 0, lengths[place - 1], crossing.time))
        for crossing, place in zip(extremes[1:], after, strict=True)
    )
    unknown_error = np.full_like(extremes.extrema.error, np.nan)
    return Extremes(extremes.extrema._replace(error=unknown_error), settling, near)


def _extremes(steps: Steps, quantities: Mapping[str, Array]) -> Extremes:
    """Return the extremes of the steps of a run."""
    extrema = farthest_from_zero(steps)
    from_rest = quantities["orientation"][-1:] - quantities["rest_orientation"]
    settling = settling_times(
        steps,
        VALUE,
        extrema.value[VALUE],
        from_rest,
        quantities["energy_round_off"][np.newaxis],
        supplied="supplied_energy" in quantities,
    )
    return Extremes(extrema, settling, last_above(steps, SQUARE, np.array([SETTLED_DISTANCE**2])))


def stored_extremes(extremes: Extremes) -> dict[str, Array]:
    """Return the extremes of a run as named arrays."""
    value, _, error = (part[:, 0] for part in extremes.extrema)
    pitch, distance = THETA_ROWS.start + PITCH, np.sqrt(value[SQUARE])
    numbers = {
        "peak_distance": distance,
        "peak_distance_error": error[SQUARE] / (2.0 * distance if distance > 0 else 1.0),
        "largest_pitch": abs(value[pitch]),
        "largest_pitch_error": error[pitch],
        "settling_time": extremes.settling.time[0],
        "settling_time_error": extremes.settling.error[0],
    }
    vectors = {
        "peak_contact_displacement": value[E_ROWS],
        "peak_contact_displacement_error": error[E_ROWS],
    }
    return vectors | {name: np.array(number) for name, number in numbers.items()}


def quaternion_of(system: System) -> QuaternionCoordinates | None:
    """Return the coordinates of a system with a quaternion; None if it has Θ."""
    coordinates = system.coordinates
    return coordinates if isinstance(coordinates, QuaternionCoordinates) else None


def leave_open(  # noqa: PLR0913, PLR0917 (steps of members)
    table: Array,
    q: QuaternionCoordinates,
    y: Array,
    after: Array,
    lengths: Array,
    first: Array,
) -> None:
    """Make the rates of θ1 and θ3 infinite where their extrema may be between the ends of steps.

    Those steps are divided; where no part shows the extremum, its error is infinite.

    Args:
        table: The values and rates at both ends of steps, shape (2, 2, q, n).
        q: The coordinates with a quaternion.
        y: The states at the begins of steps, and maybe more, shape (states, k).
        after: The place of the state at the end of each step, shape (n,).
        lengths: The lengths of the steps, shape (n,), s.
        first: The first step of each member, shape (m,).
    """
    sine = np.abs(table[:, 0, THETA_ROWS.start + PITCH]).max(axis=0)
    speed = np.sqrt((y[OMEGA] * y[OMEGA]).sum(axis=0))
    turn = lengths * np.maximum(speed[: len(lengths)], speed[after])
    # Farther from θ2 = ±90° than the body turns, θ1 and θ3 are as smooth as all else.
    near = np.flatnonzero((lengths > 0) & ~(1.0 - sine * sine > turn * turn))
    begin, end = (y[np.ix_([q.size - 1, *range(6)], steps)] for steps in (near, after[near]))
    beyond = beyond_ends(begin, end, lengths[near])
    member = np.searchsorted(first, near, side="right") - 1
    for row, over in zip((THETA_ROWS.start, THETA_ROWS.stop - 1), beyond, strict=True):
        size = np.abs(table[:, 0, row]).max(axis=0)
        largest = np.maximum.reduceat(size, first)[member]
        is_open = (over > ABSOLUTE) & (size[near] + over > largest)
        table[:, 1, row, near[is_open]] = np.inf
        rates = table[:, 1, row]
        rates[np.isnan(rates)] = np.inf


def pitch_of_sine(extrema: Extrema) -> Extrema:
    """Return extrema with θ2 in place of sin θ2; of unknown angles with errors that are NaN."""
    value, error = extrema.value.copy(), extrema.error.copy()
    pitch = THETA_ROWS.start + PITCH
    sine = np.abs(value[pitch])
    value[pitch] = np.arcsin(np.clip(value[pitch], -1.0, 1.0))
    farthest = np.arcsin(np.minimum(sine + error[pitch], 1.0))
    error[pitch] = np.maximum(farthest - np.abs(value[pitch]), 0.0)
    error[np.isinf(error)] = np.nan
    return extrema._replace(value=value, error=error)


class _StepsOfRun:
    """The steps of a run, and derivatives of what is watched, from the equations of each step."""

    def __init__(
        self, ends: StepEnds, rest: float, deadline: Deadline | None, Theta: Array
    ) -> None:
        self.ends, self.rest, self.deadline = ends, rest, deadline  # rest: the energy at rest, J
        # SciPy's solvers form cycles with this object; a view would keep the array of a batch.
        self.Theta = Theta.copy()
        # θ1 and θ3 of quaternions are continued from Θ at the start.
        self.q = quaternion_of(ends.systems[0])
        # The turn is the largest one in doubt, see `QuaternionCoordinates.angles_along`.
        self._table, self.turn = np.empty(0), 0.0
        # Of steps that are joined from short ones only the ends are known.
        self.joined = ~np.array(ends.whole[1:], dtype=bool)
        self._equations: dict[int, tuple[StraightLine, Watch]] = {}

    def steps(self) -> Steps | None:
        """Return the steps; None if the deadline has expired."""
        ends = self.ends
        rows: list[tuple[Array, Array]] = []
        previous = None
        for number, system in enumerate(ends.systems[1:]):
            if self.deadline is not None and self.deadline.remaining() < 0:
                return None
            changed = previous is not system or ends.times[number] == ends.times[number - 1]
            if previous is None or (changed and not self.joined[number]):
                before = self._observed(system, number)
            after = self._observed(system, number + 1)
            rows.append((before, after))
            before, previous = after, system
        # Shape (end, value or rate, watched, step).
        table: Array = np.moveaxis(np.array(rows), 0, -1)
        times = np.array(ends.times)
        if self.q is not None:
            y = np.array(ends.states).T
            alone = np.zeros(len(times), dtype=int)
            Theta, (self.turn,) = self.q.angles_along(y, times, self.Theta[:, np.newaxis], alone)
            turned = self.q.watched(y)
            turned[0, ::2] = Theta[::2]
            table[0][:, THETA_ROWS], table[1][:, THETA_ROWS] = turned[..., :-1], turned[..., 1:]
            after = np.arange(1, len(times))
            leave_open(table, self.q, y, after, np.diff(times), np.zeros(1, dtype=int))
        table[:, 1][..., self.joined] = 0.0
        self._table = table
        return Steps(
            np.zeros(1, dtype=int),
            times[:-1],
            np.diff(times),
            table,
            self._derivatives,
            self._divide,
        )

    def _of(self, system: System) -> tuple[StraightLine, Watch]:
        """Return the rates of a system, and the values and rates of what is watched of it."""
        if id(system) not in self._equations:
            rates = audited_rates_of(system)
            watched = StraightLine(_watched, system, timed=system.timed)

            def observe(y: Array, t: float) -> Array:
                shifted = watched(y + 1j * STEP * rates(y, t), t + 1j * STEP)
                values, slopes = shifted.real.copy(), shifted.imag / STEP
                values[VALUE] -= self.rest
                if self.q is not None:
                    values[THETA_ROWS], slopes[THETA_ROWS] = self.q.watched(y)
                return np.array([values, slopes])

            self._equations[id(system)] = rates, observe
        return self._equations[id(system)]

    def _observed(self, system: System, end: int) -> Array:
        """Return the values and rates of what is watched at the end of a step, shape (2, q)."""
        return self._of(system)[1](self.ends.states[end], self.ends.times[end])

    def _derivatives(self, quantity: Array, step: Array) -> Array:
        """Return second and third derivatives at both ends of steps (see `Steps`)."""
        derivatives, ends = np.empty((2, 2, len(step))), self.ends
        for number in np.unique(step).tolist():
            places = np.flatnonzero(step == number)
            if self.joined[number]:
                derivatives[..., places] = 0.0
                continue
            rates, watch = self._of(ends.systems[number + 1])
            length = ends.times[number + 1] - ends.times[number]
            for end in range(2):
                y, t = ends.states[number + end], ends.times[number + end]
                derivatives[end][:, places] = along(watch, rates, y, t, length)[:, quantity[places]]
        return derivatives

    def _divide(self, step: int) -> Steps | None:
        if self.joined[step]:
            return None
        ends = self.ends
        times = ends.times[step], ends.times[step + 1]
        table = self._table[..., step]
        return divided(ends.systems[step + 1], times, ends.states[step], self.rest, table)


def divided(
    system: System, times: tuple[float, float], start: Array, rest: float, table: Array
) -> Steps | None:
    """Return a step as shorter ones, made from its begin; None if they are too many.

    Args:
        system: Its smooth system.
        times: Its begin and its end, s.
        start: The audited state at its begin.
        rest: The energy at rest, J.
        table: The values and rates of what is watched at its ends, shape (2, 2, q).
    """
    if times[0] == times[1]:
        return None
    from scipy.integrate import DOP853  # imported late: batches and most runs need none of it

    rates = audited_rates_of(system)
    is_open = quaternion_of(system) and np.isinf(table[:, 1, THETA_ROWS]).any()
    longest = (times[1] - times[0]) / PARTS_IN_QUATERNIONS if is_open else np.inf
    solver = DOP853(
        lambda t, y: rates(y, t),
        times[0],
        start,
        times[1],
        rtol=FINEST,
        atol=FINEST,
        max_step=longest,
    )
    parts = StepEnds()
    parts.add(times[0], start, system)
    while solver.status == "running" and len(parts.times) < MOST_PARTS:
        solver.step()
        parts.add(solver.t, solver.y, system)
    if solver.status != "finished":
        return None
    steps = _StepsOfRun(parts, rest, None, table[0, 0, THETA_ROWS]).steps()
    return steps and steps._replace(divide=lambda _: None)


def watched_at(seen: Observation) -> list[Number]:
    """Return what is watched at a state but for v: the rows up to `TURN`."""
    peaks, motion = values_of([BY_NAME[name] for name in PEAKS], seen), seen.motion
    return [*peaks, motion.E @ motion.E, half_sine_squared(motion.A)]


def _watched(system: System, y: Array, t: Number = 0.0) -> Array:
    """Return what is watched, v with the energy at rest, shape (q,); Θ not in quaternions."""
    seen = system.observe(y, t)
    kinetic, *stored = seen.energy.tolist()
    # Added in this order: another one changes the last bits of settling times.
    return np.array([*watched_at(seen), kinetic + total_energy(stored)])
