"""The outcome of a member: one number or one vector for each column."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from rbstab.analysis.lyapunov import ENERGY_SCALE, energy_scale
from rbstab.analysis.run_extremes import E_ROWS, THETA_ROWS, Extremes
from rbstab.elements.declarations import OwnState
from rbstab.elements.registry import OWN_STATES
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Column
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.columns import MOTION_COLUMNS
from rbstab.systems.quantities import is_element_state

FINAL = ("orientation", "angular_velocity", "position", "velocity")
"""The quantities of `MemberTrajectories` whose final values are columns."""

FINAL_PREFIX, LARGEST_PREFIX = "final_", "largest_"
"""A quantity at the end, and the largest of its samples."""

STATUSES = tuple(RunStatus)
"""The statuses in the order of their codes in the column `status`."""


def _number(dtype: str, unit: str, long_name: str, flags: tuple[str, ...] = ()) -> Column:
    return Column((), dtype, unit, long_name, flags)


def _vector(unit: str, long_name: str) -> Column:
    return Column(("axis",), "f8", unit, long_name)


def final_columns(states: Iterable[OwnState]) -> dict[str, Column]:
    """Return the columns of the final values of own states."""
    return {
        f"final_{state.name}": Column(
            (state.dimension,),
            "f8",
            state.unit,
            f"{state.symbol} at the end; NaN: it has none",
            lengths=() if state.dimension == "axis" else (state.size,),
        )
        for state in states
    }


COLUMNS: dict[str, Column] = {
    "run_id": _number("S32", "1", "identity of the member as a single run"),
    "status": _number("i1", "1", "how the member ended, by its code", tuple(map(str, STATUSES))),
    "end_time": _number("f8", "s", "time reached"),
    "final_orientation": _vector("rad", "Θ at the end"),
    "final_angular_velocity": _vector("rad/s", "Ω at the end, body"),
    "final_position": _vector("m", "X at the end, inertial"),
    "final_velocity": _vector("m/s", "V at the end, inertial"),
    **final_columns(OWN_STATES.values()),
    "lyapunov_start": _number("f8", "J", "v(0)"),
    "lyapunov_end": _number("f8", "J", "v at the end"),
    "energy_at_rest": _number("f8", "J", "stored energy of the rest state at which v is zero"),
    "rest_orientation": _vector("rad", "Θ of that rest state; NaN: the member approaches none"),
    "energy_residual": _number("f8", "J", "the largest |r| of the samples or ends of steps"),
    "energy_scale": _number("f8", "J", f"the {ENERGY_SCALE}: |r| is divided by it"),
    "peak_contact_displacement": _vector("m", "E farthest from 0, by axis"),
    "peak_time": _vector("s", "when it is there"),
    "peak_orientation": _vector("rad", "the largest |Θ|, by axis"),
    "smallest_regularity": _number("f8", "1", "the smallest cos θ2"),
    "peak_contact_displacement_error": _number(
        "f8", "m", "bound of the error of the peaks of E; NaN: unknown"
    ),
    "peak_orientation_error": _number(
        "f8", "rad", "bound of the error of the largest |Θ|; NaN: unknown"
    ),
    "settling_time": _number("f8", "s", "from here v < 1e-3 v(0); NaN: it did not settle"),
    "displacement_settling_time": _number(
        "f8", "s", "from here |E| < 1 mm; NaN: it did not settle"
    ),
    "steps": _number("i4", "1", "accepted steps"),
}
"""The columns of each shard. The folder of a sweep lists its columns, so a new column does not make
older sweeps invalid. The final values of the own states of named elements come after them."""


def known_columns() -> dict[str, Column]:
    """Return all columns that shards may have, without those of own states of named elements."""
    return COLUMNS | MOTION_COLUMNS


def element_states(plan: Plan) -> tuple[OwnState, ...]:
    """Return the own states of the named elements of a plan; all its variants have them."""
    problem = next(iter(plan.initial_value_problems.values()))
    return tuple(own for own in problem.system.declared_states if is_element_state(own.name))


def outcome_columns(plan: Plan) -> dict[str, Column]:
    """Return the columns that an engine computes for the members of a plan."""
    return COLUMNS | final_columns(element_states(plan))


def columns_of(plan: Plan) -> dict[str, Column]:
    """Return the columns of the shards of a plan."""
    return outcome_columns(plan) if plan.prove is None else outcome_columns(plan) | MOTION_COLUMNS


@dataclass(frozen=True, eq=False)
class MemberTrajectories:
    """Trajectories of several members at the same samples, named as in the file of a run.

    Args:
        time: Shape (n,), s.
        orientation: Θ, rad; shape (m, n, 3), as all other vectors below.
        angular_velocity: Ω, rad/s, body.
        position: X, m, inertial; without a trace only at the last sample, shape (m, 1, 3).
        velocity: V, m/s, inertial, in the same form.
        contact_displacement: E, m, inertial.
        contact_velocity: F, m/s, inertial.
        lyapunov: v, shape (m, n), J.
        energy_residual: r, shape (m, n), J.
        energy_at_rest: The stored energy of the rest state at which v is zero, shape (m,), J.
        energy_round_off: The energy below which v is round-off, shape (m,), J.
        rest_orientation: Θ of that rest state, shape (m, 3), rad.
        own_states: The own states of the elements by name, each of shape (m, n, size).
        supplied_energy: ∫supplied dt, shape (m, n), J; None if no element supplies power.
    """

    time: Array
    orientation: Array
    angular_velocity: Array
    position: Array
    velocity: Array
    contact_displacement: Array
    contact_velocity: Array
    lyapunov: Array
    energy_residual: Array
    energy_at_rest: Array
    energy_round_off: Array
    rest_orientation: Array
    own_states: dict[str, Array] = field(default_factory=dict)
    supplied_energy: Array | None = None


def outcome_of(members: MemberTrajectories, extremes: Extremes) -> dict[str, Array]:
    """Return the columns computed from trajectories: all but `run_id`, `status` and `steps`.

    Args:
        members: The trajectories.
        extremes: Their extremes.
    """
    count = len(members.lyapunov)
    peaks, settling = extremes.extrema, extremes.settling.time
    last = {FINAL_PREFIX + name: getattr(members, name)[:, -1] for name in FINAL}
    for state in OWN_STATES.values():
        last[f"final_{state.name}"] = np.full((count, state.size), np.nan)
    for name, values in members.own_states.items():
        last[f"final_{name}"] = values[:, -1]
    peak, angles = peaks.value[E_ROWS].T, np.abs(peaks.value[THETA_ROWS]).T
    return last | {
        "end_time": np.full(count, members.time[-1]),
        "lyapunov_start": members.lyapunov[:, 0],
        "lyapunov_end": members.lyapunov[:, -1],
        "energy_at_rest": members.energy_at_rest,
        "rest_orientation": members.rest_orientation,
        "energy_residual": np.abs(members.energy_residual).max(axis=1),
        "energy_scale": energy_scale(
            members.lyapunov, members.energy_round_off, members.supplied_energy
        ),
        "peak_contact_displacement": peak,
        # Where nothing moves, the largest sample is that of the largest round-off.
        "peak_time": np.where(settling[:, np.newaxis] == 0.0, 0.0, peaks.time[E_ROWS].T),
        "peak_orientation": angles,
        "smallest_regularity": np.cos(np.minimum(angles[:, 1], np.pi / 2)),
        "peak_contact_displacement_error": peaks.error[E_ROWS].max(axis=0),
        "peak_orientation_error": peaks.error[THETA_ROWS].max(axis=0),
        "settling_time": settling,
        "displacement_settling_time": extremes.displacement_settling.time,
    }


def largest_of_finals(members: MemberTrajectories) -> dict[str, Array]:
    """Return the largest sample, by component, of each quantity whose final value is a column.

    A motion that comes to rest ends with round-off, which is no scale for differences.
    """
    quantities = {name: getattr(members, name) for name in FINAL} | members.own_states
    return {
        LARGEST_PREFIX + name: np.abs(values).max(axis=1) for name, values in quantities.items()
    }
