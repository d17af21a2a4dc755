"""The record of a run: its trajectory as named arrays, with its certificate."""

import math
import time
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rbstab.analysis.approached_state import LyapunovZero, lyapunov_zero
from rbstab.analysis.certificate.verdict import Check
from rbstab.analysis.lyapunov import has_no_potential, lyapunov_trace
from rbstab.analysis.rest_state import RestState, nearest_rest_state
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.analysis.run_extremes import extremes_of, stored_extremes
from rbstab.analysis.settling import value_round_off
from rbstab.experiment.convergence.zero_description import no_rest_state_warning
from rbstab.experiment.run_certificate import certificate_of
from rbstab.experiment.switching_record import (
    impact_arrays,
    switching_arrays,
)
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Trajectory, first_samples
from rbstab.integrate.status import RunStatus
from rbstab.integrate.watched_rates import EquationsInTime
from rbstab.mechanics.numbers import Array, Number
from rbstab.store.variables import Variable
from rbstab.systems.quantities import (
    Quantity,
    named_elements,
    observed_in,
    quantities_with,
    run_dimensions,
    values_of,
)
from rbstab.systems.system import System

RECORDING_MARGIN = 0.1
"""s: the time after the deadline at which samples that are not recorded yet are dropped. Without it
a slow moment of the machine would cost samples."""

RECORDING_FACTOR = 1.2
"""The time to record a sample, divided by the time to observe a system."""

TIMED_OBSERVATIONS = 5
"""The fastest of this many observations counts; the others may have been interrupted."""


_EVENTS = {
    "switch": "switch_time",
    "transition": "transition_time",
    "impact": "impact_time",
    "rest": "rest_begin",
}
"""The dimensions along which events are stored, each with an array that has it."""


class Record(NamedTuple):
    """The stored data of a run.

    Attributes:
        trajectory: The trajectory that is recorded.
        variables: The arrays by their names in `QUANTITIES`, and the coordinates of their
            dimensions.
        checks: The checks of the certificate that need no proof.
        zero: The rest state at which v is zero.
        warnings: Warnings about the rest state.
    """

    trajectory: Trajectory
    variables: dict[str, Variable]
    checks: list[Check]
    zero: LyapunovZero
    warnings: list[str]


class RecordedTrajectory(NamedTuple):
    """A trajectory with its quantities, by their names in `QUANTITIES`.

    It is shorter than the trajectory of the engine if the deadline ended the recording.
    """

    trajectory: Trajectory
    quantities: dict[str, Array]


def rest_state_of(problem: Problem) -> RestState:
    """Return the rest state of a problem that is nearest to the unloaded position."""
    with np.errstate(all="ignore"):
        return nearest_rest_state(smooth_rest_system(problem))


def zero_of(
    problem: Problem,
    trajectory: Trajectory,
    nearest: RestState | None = None,
    deadline: Deadline | None = None,
) -> LyapunovZero:
    """Return the rest state at which the Lyapunov function along a trajectory is zero.

    Args:
        problem: The problem.
        trajectory: Its trajectory.
        nearest: `rest_state_of(problem)`, if it is known already.
        deadline: The deadline of the run; None for no limit.
    """

    def is_late() -> bool:
        return deadline is not None and deadline.is_late(RECORDING_MARGIN)

    nearest = nearest or rest_state_of(problem)
    if trajectory.status in (RunStatus.RANGE_LEFT, RunStatus.DIVERGED, RunStatus.ZERO_LENGTH):
        return LyapunovZero(nearest, approached=False, is_lowest=True)
    system = trajectory.systems[-1] if trajectory.systems else problem.system
    last = trajectory.states[-1]
    own = last[system.coordinates.size :]
    with np.errstate(all="ignore"):
        smooth, motion = smooth_rest_system(problem), system.motion(last)
        return lyapunov_zero(smooth, motion, own, nearest, is_late)


def recording_time(problem: Problem, only_outcome: bool = False) -> float:
    """Measure the time to record one sample of a problem, s; `only_outcome` as for `recorded`."""
    observe = _Observer(only_outcome)
    first = float(problem.times[0])
    with np.errstate(all="ignore"):
        # The first observation of a system takes longer than all others.
        observe(problem.system, problem.start, first)
        times = []
        for _ in range(TIMED_OBSERVATIONS):
            begin = time.perf_counter()
            observe(problem.system, problem.start, first)
            times.append(time.perf_counter() - begin)
    return RECORDING_FACTOR * min(times)


def record_of(
    problem: Problem,
    trajectory: Trajectory,
    nearest: RestState | None = None,
    deadline: Deadline | None = None,
) -> Record:
    """Return all quantities of a run along its trajectory, and its certificate.

    Args:
        problem: The initial value problem.
        trajectory: The trajectory.
        nearest: `rest_state_of(problem)`, if it is known already.
        deadline: The deadline of the run; None for no limit. See `recorded`.
    """
    zero = zero_of(problem, trajectory, nearest, deadline)
    with np.errstate(all="ignore"):
        trajectory, arrays = recorded(problem, trajectory, zero.rest, deadline)
        arrays |= stored_extremes(extremes_of(problem, trajectory, arrays, deadline))
        checks = certificate_of(problem, trajectory, arrays, zero)
    parts = np.array(problem.system.parts, dtype=object)
    quantities = quantities_with(problem.system.declared_states)
    coordinates = {
        name: Variable((name,), np.arange(1, len(arrays[source]) + 1), "1", f"number of the {name}")
        for name, source in _EVENTS.items()
        if source in arrays
    } | {
        **{
            name: Variable((name,), np.arange(1, length + 1), "1", "component of a vector")
            for name, length in run_dimensions(problem.system.declared_states).items()
            if any(name in quantities[array].dimensions for array in arrays)
        },
        "part": Variable(("part",), parts, "1", "part of the system"),
    }
    named = np.array(named_elements(problem.system), dtype=object)
    if len(named):
        coordinates["element"] = Variable(("element",), named, "1", "element of the config")
    described = {
        name: _variable(quantity, arrays[name])
        for name, quantity in quantities.items()
        if name in arrays
    }
    warnings = [] if zero.rest.is_at_rest else [no_rest_state_warning(problem.system)]
    return Record(trajectory, coordinates | described, checks, zero, warnings)


def recorded(
    problem: Problem,
    trajectory: Trajectory,
    rest: RestState,
    deadline: Deadline | None = None,
    only_outcome: bool = False,
) -> RecordedTrajectory:
    """Return a trajectory with all its quantities.

    Args:
        problem: The initial value problem.
        trajectory: The trajectory.
        rest: The rest state at which v is zero.
        deadline: The deadline of the run; None for no limit. Samples that cannot be recorded in
            time are dropped; then the status is `TIME_LIMIT`.
        only_outcome: Whether only the quantities are recorded that the outcome of a member of a
            sweep needs: no forces, couples, dissipation and v'. Then a sample takes a
            quarter of the time. What is recorded has the same bits.
    """
    system = problem.system
    # Overflow is the result of a diverged run, not an error.
    with np.errstate(all="ignore"):
        arrays = _observed(system, trajectory, deadline, only_outcome)
        count = len(arrays["energy"])
        if deadline is not None and count < len(trajectory.times):
            trajectory = first_samples(trajectory, count, deadline)
        arrays = {"time": trajectory.times, **arrays}
        change = trajectory.lyapunov_change
        if trajectory.switches is not None:
            arrays |= switching_arrays(trajectory.switches)
            change = change - trajectory.switches.discarded_energy
        if trajectory.trusted_until is not None:
            arrays["trusted_until"] = np.array(trajectory.trusted_until)
        if trajectory.impacts is not None:
            arrays |= impact_arrays(system, trajectory.impacts)
            change = change - trajectory.impacts.lost
        if has_no_potential(system):
            # The contact force has no potential, so v - ε replaces v (eq. 28).
            arrays["energy"][:, system.parts.index("connector")] = -trajectory.contact_work
        value, residual = lyapunov_trace(arrays["energy"], change, rest.energy)
    quantities = arrays | {
        "lyapunov": value,
        "lyapunov_change": trajectory.lyapunov_change,
        "energy_residual": residual,
        "contact_work": trajectory.contact_work,
        "energy_at_rest": np.array(rest.energy),
        "energy_round_off": np.array(_round_off(system, trajectory)),
        "rest_orientation": rest.motion.Theta,
        "rest_position": rest.motion.X,
    }
    if trajectory.supplied_energy is not None:
        quantities["supplied_energy"] = trajectory.supplied_energy
    return RecordedTrajectory(trajectory, quantities)


def _round_off(system: System, trajectory: Trajectory) -> float:
    """Return the energy below which v is round-off, J."""
    return float(value_round_off(lambda y: system.observe(y).energy, trajectory.states[0]))


def motion_warnings(trajectory: Trajectory) -> list[str]:
    """Return warnings about a motion.

    θ1 or θ3 may leave the range of eq. 5; no equation becomes singular then. `trusted_until` may be
    unknown, or earlier than the end. Numbers of a config may overflow or underflow in the rates.
    """
    warnings = []
    if trajectory.status is RunStatus.DIVERGED and len(trajectory.times) == 1:
        warnings.append(
            "numbers of the config are too small or too large: its rates underflow or overflow in "
            "double precision"
        )
    for index, name in ((0, "θ1"), (2, "θ3")):
        outside = np.abs(trajectory.states[:, index]) > math.pi
        if outside.any():
            t = trajectory.times[int(outside.argmax())]
            warnings.append(f"{name} is outside [-π, π], the range of eq. 5, from t = {t:.6g} s")
    switches, trusted = trajectory.switches, trajectory.trusted_until
    if switches is not None:
        trusted = switches.trusted_until
    if trusted is not None and np.isnan(trusted):
        warnings.append("trusted_until is unknown: the time limit ended the run that determines it")
    elif trusted is not None and trusted < _last_comparable(trajectory):
        warnings.append(
            f"the motion is not reproducible after t = {trusted:.6g} s (trusted_until): a start "
            "that differs in the last digit leads to another motion"
        )
    return warnings


def _last_comparable(trajectory: Trajectory) -> float:
    """Return the last time at which two runs of one motion can be compared, s.

    Where a run ends early, its last sample is no common one.
    """
    completed = trajectory.status is RunStatus.COMPLETED
    return float(trajectory.times[-1 if completed else max(-2, -len(trajectory.times))])


def _observed(
    system: System, trajectory: Trajectory, deadline: Deadline | None, only_outcome: bool
) -> dict[str, Array]:
    """Return the observed quantities of the samples; of fewer if the deadline expires."""
    lengths = run_dimensions(system.declared_states)
    lengths |= {"part": len(system.parts), "element": len(named_elements(system))}
    shapes = {
        name: tuple(lengths[dimension] for dimension in quantity.dimensions[1:])
        for name, quantity in recorded_in(system, only_outcome).items()
    }
    ends = np.cumsum([0, *map(math.prod, shapes.values())]).tolist()
    count = len(trajectory.times)
    table = np.empty((count, ends[-1]))
    observe = _Observer(only_outcome)
    systems = trajectory.systems or (system,) * count
    samples = zip(systems, trajectory.states, trajectory.times.tolist(), strict=True)
    for row, (system_now, state, t) in enumerate(samples):
        if row and deadline is not None and deadline.remaining() < -RECORDING_MARGIN:
            count = row
            break
        table[row] = observe(system_now, state, t)
    return {
        name: table[:count, begin:end].reshape(count, *shape)
        for (name, shape), (begin, end) in zip(shapes.items(), pairwise(ends), strict=True)
    }


class _Observer:
    """Evaluates quantities of systems at states: by code that is made from the equations.

    numpy would take twenty times as long. A system that occurs first gets an evaluation of its own,
    but systems that differ in their modes share one code.

    Args:
        only_outcome: As for `recorded`.
    """

    def __init__(self, only_outcome: bool) -> None:
        self._quantities = _values_of_outcome if only_outcome else _values
        self._of: dict[int, EquationsInTime] = {}

    def __call__(self, system: System, state: Array, t: float) -> Array:
        """Return the quantities of a system that outlives this object."""
        found = self._of.get(id(system))
        if found is None:
            found = EquationsInTime(self._quantities, system, size=len(state))
            self._of[id(system)] = found
        return found(state, t)


def recorded_in(system: System, only_outcome: bool) -> dict[str, Quantity]:
    """Return the quantities that are evaluated at samples, in the order of files."""
    found = observed_in(system)
    if not only_outcome:
        return found
    return {name: one for name, one in found.items() if one.in_outcome}


def _values(system: System, state: Array, t: Number = 0.0, only_outcome: bool = False) -> Array:
    """Return the quantities of `recorded_in` at a state, one after the other."""
    quantities = recorded_in(system, only_outcome).values()
    return np.array(values_of(quantities, system.observe(state, t)))


def _values_of_outcome(system: System, state: Array, t: Number = 0.0) -> Array:
    return _values(system, state, t, only_outcome=True)


def _variable(quantity: Quantity, data: Array) -> Variable:
    return Variable(quantity.dimensions, data, quantity.unit, quantity.long_name)
