"""The outcome of a member: one number or one vector for each column."""

from collections.abc import Iterable, Mapping

import numpy as np

from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.analysis.run_extremes import E_ROWS, ROWS, THETA_ROWS, TURN, Extremes
from rbstab.elements.declarations import OwnState
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.store.table import Column
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.columns import MOTION_COLUMNS
from rbstab.systems.quantities import (
    BY_NAME,
    PEAKS,
    RUN_DIMENSIONS,
    Quantity,
    is_element_state,
    run_dimensions,
    state_quantity,
)

FINAL_PREFIX, LARGEST_PREFIX = "final_", "largest_"
"""A quantity at the end, and the largest of its samples."""

STATUSES = tuple(RunStatus)
"""The statuses in the order of their codes in the column `status`."""


def _number(dtype: str, unit: str, long_name: str, flags: tuple[str, ...] = ()) -> Column:
    return Column((), dtype, unit, long_name, flags)


def _vector(unit: str, long_name: str) -> Column:
    return Column(("axis",), "f8", unit, long_name)


def _final(quantity: Quantity, lengths: Mapping[str, int]) -> Column:
    """Return the column of a quantity at the end."""
    dimensions = quantity.dimensions[1:]
    sizes = tuple(lengths[dimension] for dimension in dimensions if dimension != "axis")
    long_name = f"{quantity.symbol} at the end{quantity.end}"
    return Column(dimensions, "f8", quantity.unit, long_name, lengths=sizes)


def final_columns(states: Iterable[OwnState]) -> dict[str, Column]:
    """Return the columns of the final values of own states."""
    states = tuple(states)
    lengths = run_dimensions(states)
    return {FINAL_PREFIX + state.name: _final(state_quantity(state), lengths) for state in states}


def _peak_columns() -> dict[str, Column]:
    """Return the columns of the largest values of quantities, and of their errors."""
    columns = {}
    for name, peak in PEAKS.items():
        unit, error = BY_NAME[name].unit, f"bound of the error of {peak.meaning}; NaN: unknown"
        columns[f"peak_{name}"] = _vector(unit, peak.meaning)
        columns[f"peak_{name}_error"] = _number("f8", unit, error)
    return columns


COLUMNS: dict[str, Column] = {
    "status": _number("i1", "1", "how the member ended, by its code", tuple(map(str, STATUSES))),
    "end_time": _number("f8", "s", "time reached"),
    **{
        FINAL_PREFIX + name: _final(quantity, RUN_DIMENSIONS)
        for name, quantity in BY_NAME.items()
        if quantity.end is not None
    },
    "lyapunov_start": _number("f8", "J", "v(0)"),
    "lyapunov_end": _number("f8", "J", "v at the end"),
    "energy_at_rest": _number("f8", "J", "stored energy of the rest state at which v is zero"),
    "rest_orientation": _vector("rad", "Θ of that rest state; NaN: the member approaches none"),
    "rest_unstable": _number(
        "i1", "1", "whether the stored energy falls in some direction there", ("no", "yes")
    ),
    "energy_residual": _number("f8", "J", "the largest |r| of the samples or ends of steps"),
    "energy_scale": _number("f8", "J", f"the {ENERGY_SCALE}: |r| is divided by it"),
    **_peak_columns(),
    "peak_tilt": _number("f8", "rad", "the largest tilt from Θ = 0"),
    "peak_tilt_error": _number("f8", "rad", "bound of the error of the largest tilt; NaN: unknown"),
    "peak_time": _vector("s", "when E is farthest from 0, by axis"),
    "smallest_regularity": _number("f8", "1", "the smallest cos θ2"),
    "settling_time": _number("f8", "s", "from here v < 1e-3 v(0); NaN: it did not settle"),
    "settling_time_error": _number("f8", "s", "bound of its error"),
    "displacement_settling_time": _number(
        "f8", "s", "from here |E| < 1 mm; NaN: it did not settle"
    ),
    "displacement_settling_time_error": _number("f8", "s", "bound of its error"),
    "steps": _number("i4", "1", "accepted steps"),
}
"""The columns of each shard. The folder of a sweep lists its columns, so a new column does not make
older sweeps invalid. The final values of the own states of named elements come after them."""


def shard_columns() -> dict[str, Column]:
    """Return all columns that shards may have, without those of own states of named elements."""
    return COLUMNS | MOTION_COLUMNS


def element_states(plan: Plan) -> tuple[OwnState, ...]:
    """Return the own states of the named elements of a plan; all its variants have them."""
    problem = next(iter(plan.initial_value_problems.values()))
    return tuple(state for state in problem.system.declared_states if is_element_state(state.name))


def outcome_columns(plan: Plan) -> dict[str, Column]:
    """Return the columns that an engine computes for the members of a plan."""
    return COLUMNS | final_columns(element_states(plan))


def columns_of(plan: Plan) -> dict[str, Column]:
    """Return the columns of the shards of a plan."""
    return outcome_columns(plan) if plan.prove is None else outcome_columns(plan) | MOTION_COLUMNS


def finals_of(quantities: Mapping[str, Array]) -> dict[str, Array]:
    """Return those quantities whose values at the end are columns."""
    return {
        name: values
        for name, values in quantities.items()
        if is_element_state(name) or (name in BY_NAME and BY_NAME[name].end is not None)
    }


def outcome_of(quantities: Mapping[str, Array], extremes: Extremes) -> dict[str, Array]:
    """Return the columns that follow from motions: all but `status`, `steps` and those of energies.

    Args:
        quantities: The quantities of m members at n times (`time`, shape (n,), s) by their names,
            shape (m, n, ...), or (m, ...) if they are not along the time. At least the first and
            the last sample of v and of all that has a final value.
        extremes: The extremes of the motions.
    """
    peaks, settling = extremes.extrema, extremes.settling.time
    columns = {FINAL_PREFIX + name: values[:, -1] for name, values in finals_of(quantities).items()}
    for name, peak in PEAKS.items():
        value = peaks.value[ROWS[name]].T
        columns[f"peak_{name}"] = value if peak.signed else np.abs(value)
        columns[f"peak_{name}_error"] = peaks.error[ROWS[name]].max(axis=0)
    pitch = np.abs(peaks.value[THETA_ROWS][PITCH])
    turn, error = peaks.value[TURN], peaks.error[TURN]
    tilt, farthest = (2.0 * np.arcsin(np.sqrt(np.minimum(s, 1.0))) for s in (turn, turn + error))
    return columns | {
        "end_time": np.full(len(settling), quantities["time"][-1]),
        "lyapunov_start": quantities["lyapunov"][:, 0],
        "lyapunov_end": quantities["lyapunov"][:, -1],
        "energy_at_rest": quantities["energy_at_rest"],
        "rest_orientation": quantities["rest_orientation"],
        "rest_unstable": quantities["rest_unstable"],
        "peak_tilt": tilt,
        "peak_tilt_error": farthest - tilt,
        # Where nothing moves, the largest sample is that of the largest round-off.
        "peak_time": np.where(settling[:, np.newaxis] == 0.0, 0.0, peaks.time[E_ROWS].T),
        "smallest_regularity": np.cos(np.minimum(pitch, np.pi / 2)),
        "settling_time": settling,
        "settling_time_error": extremes.settling.error,
        "displacement_settling_time": extremes.displacement_settling.time,
        "displacement_settling_time_error": extremes.displacement_settling.error,
    }
