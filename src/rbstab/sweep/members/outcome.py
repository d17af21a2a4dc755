"""What a sweep keeps of each member: one number, or three, for each of these columns."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.analysis.peaks import peaks_at_samples
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array

SETTLED = 1e-3
"""Of v(0): a motion has settled once v stays below this."""

CLOSE = 1e-3
"""m: the contact point has settled once |E| stays below this."""

STATUSES = tuple(RunStatus)
"""The statuses in the order of their codes in the column `status`."""


class OutcomeColumn(NamedTuple):
    """One column: its name in files, the shape and type of a member's entry, unit and meaning."""

    name: str
    shape: tuple[int, ...]
    dtype: str
    unit: str
    meaning: str


_VECTOR = (3,)

COLUMNS = (
    OutcomeColumn("run_id", (), "S32", "1", "identity of the member as a single run"),
    OutcomeColumn("status", (), "i1", "1", "how the member ended, by its code"),
    OutcomeColumn("end_time", (), "f8", "s", "time reached"),
    OutcomeColumn("final_orientation", _VECTOR, "f8", "rad", "Θ at the end"),
    OutcomeColumn("final_angular_velocity", _VECTOR, "f8", "rad/s", "Ω at the end, body"),
    OutcomeColumn("final_position", _VECTOR, "f8", "m", "X at the end, inertial"),
    OutcomeColumn("final_velocity", _VECTOR, "f8", "m/s", "V at the end, inertial"),
    OutcomeColumn("final_connector_state", _VECTOR, "f8", "m", "D at the end; NaN: it has none"),
    OutcomeColumn("lyapunov_start", (), "f8", "J", "v(0)"),
    OutcomeColumn("lyapunov_end", (), "f8", "J", "v at the end"),
    OutcomeColumn("energy_residual", (), "f8", "J", "the largest |r| of the samples"),
    OutcomeColumn("peak_contact_displacement", _VECTOR, "f8", "m", "E farthest from 0, by axis"),
    OutcomeColumn("peak_time", _VECTOR, "f8", "s", "when it is there"),
    OutcomeColumn("peak_orientation", _VECTOR, "f8", "rad", "the largest |Θ|, by axis"),
    OutcomeColumn("smallest_regularity", (), "f8", "1", "the smallest cos θ2"),
    OutcomeColumn(
        "settling_time", (), "f8", "s", "from here v < 1e-3 v(0); NaN: it did not settle"
    ),
    OutcomeColumn(
        "displacement_settling_time", (), "f8", "s", "from here |E| < 1 mm; NaN: it did not settle"
    ),
    OutcomeColumn("steps", (), "i4", "1", "accepted steps"),
)


@dataclass(frozen=True, eq=False)
class Traces:
    """Motions of several members at the same samples.

    Args:
        times: Shape (n,), s.
        Theta: Θ, shape (m, n, 3), rad; Theta_rate (BΩ), Omega, X, V, E and F alike.
        own: The elements' own states, shape (m, n, 3), or None.
        value: v, shape (m, n), J.
        residual: r, shape (m, n), J.
        work: ε, shape (m, n), J, where `value` is v - ε (on s = F + κE): that does not end at zero,
            and v alone tells when a motion has settled.
    """

    times: Array
    Theta: Array
    Theta_rate: Array
    Omega: Array
    X: Array
    V: Array
    E: Array
    F: Array
    own: Array | None
    value: Array
    residual: Array
    work: Array | None = None


def outcome_of(traces: Traces) -> dict[str, Array]:
    """The columns that follow from the motions: all but `run_id`, `status` and `steps`."""
    times, members = traces.times, len(traces.value)
    last = {
        "final_orientation": traces.Theta[:, -1],
        "final_angular_velocity": traces.Omega[:, -1],
        "final_position": traces.X[:, -1],
        "final_velocity": traces.V[:, -1],
        "final_connector_state": np.full((members, 3), np.nan)
        if traces.own is None
        else traces.own[:, -1],
    }
    peak, peak_time = _peaks(times, traces.E, traces.F)
    angles, _ = _peaks(times, traces.Theta, traces.Theta_rate)
    distance = np.linalg.norm(traces.E, axis=2)
    value = traces.value if traces.work is None else traces.value + traces.work
    return last | {
        "end_time": np.full(members, times[-1]),
        "lyapunov_start": traces.value[:, 0],
        "lyapunov_end": traces.value[:, -1],
        "energy_residual": np.abs(traces.residual).max(axis=1),
        "peak_contact_displacement": peak,
        "peak_time": peak_time,
        "peak_orientation": np.abs(angles),
        "smallest_regularity": np.cos(np.minimum(np.abs(angles[:, 1]), np.pi / 2)),
        "settling_time": settling_times(times, value),
        "displacement_settling_time": last_above(times, distance, np.full(members, CLOSE)),
    }


def settling_times(times: Array, value: Array) -> Array:
    """From when v stays below `SETTLED` v(0), shape (m,), s.

    NaN where it does not by the end, and where v is not finite throughout.

    Args:
        times: Shape (n,), s.
        value: v of each member, shape (m, n), J.
    """
    found = last_above(times, value, SETTLED * value[:, 0])
    return np.where(np.isfinite(value).all(axis=1), found, np.nan)


def _peaks(times: Array, values: Array, rates: Array) -> tuple[Array, Array]:
    peak, when = peaks_at_samples(times, np.swapaxes(values, 1, 2), np.swapaxes(rates, 1, 2))
    return peak, when


def last_above(times: Array, size: Array, bound: Array) -> Array:
    """When a quantity is last at its bound or above, shape (m,), s, linear between samples.

    0 where it never is, NaN where it still is at the end.
    """
    above = size >= bound[:, np.newaxis]
    backwards = np.ascontiguousarray(above[:, ::-1])  # numpy searches these several times as fast
    last = len(times) - 1 - backwards.argmax(axis=1)
    rows, after = np.arange(len(size)), np.minimum(last + 1, len(times) - 1)
    before_size, after_size = size[rows, last], size[rows, after]
    with np.errstate(all="ignore"):
        share = (before_size - bound) / (before_size - after_size)
        found = times[last] + share * (times[after] - times[last])
    found = np.where(last == len(times) - 1, np.nan, found)
    return np.where(above.any(axis=1), found, 0.0)
