"""The record of a run: its trajectory as named arrays, with its certificate."""

import math
import time
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rbstab.analysis.approached_state import LyapunovZero, lyapunov_zero
from rbstab.analysis.certificate.checks import checks_of
from rbstab.analysis.certificate.evidence import evidence_of
from rbstab.analysis.certificate.verdict import Check
from rbstab.analysis.lyapunov import has_no_potential, lyapunov_trace
from rbstab.analysis.rest_state import RestState, nearest_rest_state
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.analysis.run_extremes import extremes_of, stored_extremes
from rbstab.analysis.settling import value_round_off
from rbstab.experiment.switching_record import event_arrays
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Trajectory, first_samples
from rbstab.integrate.status import RunStatus
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.mechanics.numbers import Array, Number
from rbstab.store.variables import Variable
from rbstab.systems.quantities import (
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


class Record(NamedTuple):
    """The stored data of a run.

    Attributes:
        trajectory: The trajectory that is recorded.
        variables: The arrays by their names in `QUANTITIES`, and the coordinates of their
            dimensions.
        checks: The checks of the certificate that need no proof.
        zero: The rest state at which v is zero.
    """

    trajectory: Trajectory
    variables: dict[str, Variable]
    checks: list[Check]
    zero: LyapunovZero


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
    nearest: RestState,
    deadline: Deadline | None = None,
) -> LyapunovZero:
    """Return the rest state at which the Lyapunov function along a trajectory is zero.

    Args:
        problem: The problem.
        trajectory: Its trajectory.
        nearest: `rest_state_of(problem)`.
        deadline: The deadline of the run; None for no limit.
    """

    def is_late() -> bool:
        return deadline is not None and deadline.is_late(RECORDING_MARGIN)

    if trajectory.status in (RunStatus.RANGE_LEFT, RunStatus.DIVERGED, RunStatus.ZERO_LENGTH):
        return LyapunovZero(nearest, approached=False, is_lowest=True)
    system, last = trajectory.systems[-1], trajectory.states[-1]
    element_states = last[system.coordinates.size :]
    with np.errstate(all="ignore"):
        smooth, motion = smooth_rest_system(problem), system.motion(last)
        return lyapunov_zero(smooth, motion, element_states, nearest, is_late)


def recording_time(problem: Problem) -> float:
    """Measure the time to record one sample of a problem, s."""
    observe = _Observer()
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
    nearest: RestState,
    deadline: Deadline | None = None,
) -> Record:
    """Return all quantities of a run along its trajectory, and its certificate.

    Args:
        problem: The initial value problem.
        trajectory: The trajectory.
        nearest: `rest_state_of(problem)`.
        deadline: The deadline of the run; None for no limit. See `recorded`.
    """
    zero = zero_of(problem, trajectory, nearest, deadline)
    with np.errstate(all="ignore"):
        trajectory, arrays = recorded(problem, trajectory, zero.rest, deadline)
        arrays |= stored_extremes(extremes_of(problem, trajectory, arrays, deadline))
        checks = checks_of(evidence_of(problem, trajectory, arrays, zero))
    return Record(trajectory, _variables(problem.system, arrays), checks, zero)


def _variables(system: System, arrays: dict[str, Array]) -> dict[str, Variable]:
    """Return quantities as they are stored, after the coordinates of their dimensions."""
    quantities = quantities_with(system.declared_states)
    described = {
        name: Variable(quantity.dimensions, arrays[name], quantity.unit, quantity.long_name)
        for name, quantity in quantities.items()
        if name in arrays
    }
    words = {"part": system.parts, "element": named_elements(system)}
    meanings = {"part": "part of the system", "element": "element of the config"}
    meanings |= {
        name: f"number of the {name}" for name in ("switch", "transition", "impact", "rest")
    }
    coordinates: dict[str, Variable] = {}
    for variable in described.values():
        for name, count in zip(variable.dimensions, variable.data.shape, strict=True):
            if name in words:
                labels = np.array(words[name], dtype=object)
            else:
                labels = np.arange(1, count + 1)
            meaning = meanings.get(name, "component of a vector")
            coordinates[name] = Variable((name,), labels, "1", meaning)
    return coordinates | described


def recorded(
    problem: Problem,
    trajectory: Trajectory,
    rest: RestState,
    deadline: Deadline | None = None,
) -> RecordedTrajectory:
    """Return a trajectory with all its quantities.

    Args:
        problem: The initial value problem.
        trajectory: The trajectory.
        rest: The rest state at which v is zero.
        deadline: The deadline of the run; None for no limit. Samples that cannot be recorded in
            time are dropped; then the status is `TIME_LIMIT`.
    """
    system = problem.system
    # Overflow is the result of a diverged run, not an error.
    with np.errstate(all="ignore"):
        arrays = _observed(system, trajectory, deadline)
        count = len(arrays["energy"])
        if deadline is not None and count < len(trajectory.times):
            trajectory = first_samples(trajectory, count, deadline)
        arrays = {"time": trajectory.times, **arrays}
        change = trajectory.lyapunov_change
        events = event_arrays(system, trajectory)
        arrays |= events
        for lost in ("discarded_energy", "impact_loss"):
            change = change - events.get(lost, 0.0)
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


def _observed(
    system: System, trajectory: Trajectory, deadline: Deadline | None
) -> dict[str, Array]:
    """Return the observed quantities of the samples; of fewer if the deadline expires."""
    lengths = run_dimensions(system.declared_states)
    lengths |= {"part": len(system.parts), "element": len(named_elements(system))}
    shapes = {
        name: tuple(lengths[dimension] for dimension in quantity.dimensions[1:])
        for name, quantity in observed_in(system).items()
    }
    ends = np.cumsum([0, *map(math.prod, shapes.values())]).tolist()
    count = len(trajectory.times)
    table = np.empty((count, ends[-1]))
    observe = _Observer()
    samples = zip(trajectory.systems, trajectory.states, trajectory.times.tolist(), strict=True)
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
    """Evaluates quantities of systems at states: by code that is made from the equations."""

    def __init__(self) -> None:
        self._of: dict[int, StraightLine] = {}

    def __call__(self, system: System, state: Array, t: float) -> Array:
        """Return the quantities of a system that outlives this object."""
        straight_line = self._of.get(id(system))
        if straight_line is None:
            # numpy would take twenty times as long. Systems that differ in their modes share one
            # code.
            straight_line = StraightLine(_values, system, len(state), timed=system.timed)
            self._of[id(system)] = straight_line
        return straight_line(state, t)


def _values(system: System, state: Array, t: Number = 0.0) -> Array:
    """Return the quantities of `observed_in` at a state, one after the other."""
    return np.array(values_of(observed_in(system).values(), system.observe(state, t)))
