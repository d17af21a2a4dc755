"""The few numbers by which a run is judged at a glance."""

from typing import NamedTuple

import numpy as np

from rbstab.analysis.lyapunov import relative_residual
from rbstab.analysis.peaks import signed_peak
from rbstab.mechanics.attitude import rate_matrix
from rbstab.mechanics.numbers import Array
from rbstab.store.result import Result


class Summary(NamedTuple):
    """A run in a few numbers.

    v at both ends, J; the largest audit residual |r| over v(0); the largest |E|, m, and the value
    of E farthest from zero by axis, m; the largest |θ2|, rad; the last time reached, s. Peaks are
    those between the samples (see `signed_peak`).
    """

    lyapunov_start: float
    lyapunov_end: float
    relative_residual: float
    peak_distance: float
    peak_contact_displacement: tuple[float, float, float]
    largest_pitch: float
    end_time: float


def summary_of(result: Result) -> Summary:
    """The summary of a result, from its stored arrays alone."""
    t, v = result["time"], result["lyapunov"]
    E, F = result["contact_displacement"], result["contact_velocity"]
    Theta, Omega = result["orientation"], result["angular_velocity"]
    with np.errstate(all="ignore"):
        distance = np.linalg.norm(E, axis=1)
        distance_rate = (E * F).sum(axis=1) / np.where(distance > 0, distance, 1.0)
        pitch_rate = _rates_where_largest(t, Theta, Omega)
        x, y, z = (signed_peak(t, E[:, axis], F[:, axis]) for axis in range(3))
        return Summary(
            float(v[0]),
            float(v[-1]),
            relative_residual(result["energy_residual"], v, result["energy"]),
            signed_peak(t, distance, distance_rate),
            (x, y, z),
            abs(signed_peak(t, Theta[:, 1], pitch_rate)),
            float(t[-1]),
        )


def _rates_where_largest(t: Array, Theta: Array, Omega: Array) -> Array:
    """The rate of θ2, shape (n,), rad/s, at samples beside which |θ2| can be largest; 0 elsewhere.

    |θ̇2| is at most |Ω|, so that a cubic passes the larger of its ends by less than h max|Ω|. With
    rates of zero it does not pass it at all.
    """
    pitch = np.abs(Theta[:, 1])
    reach = np.diff(t).max(initial=0.0) * np.linalg.norm(Omega, axis=1).max()
    near = np.concatenate([[False], pitch >= pitch.max() - reach, [False]])
    rates = np.zeros(len(t))
    for k in np.flatnonzero(near[:-2] | near[1:-1] | near[2:]).tolist():
        rates[k] = (rate_matrix(Theta[k]) @ Omega[k])[1]
    return rates


def without_work(result: Result) -> Array:
    """v, shape (n,), J, also where the result has v - ε in its place (on s = F + κE).

    v - ε does not end at zero, so that v alone tells when a motion has settled.
    """
    v, parts = result["lyapunov"], result["part"].tolist()
    if result.attributes.get("variant") != "sliding" or "connector" not in parts:
        return v
    connector, work = result["energy"][:, parts.index("connector")], result["contact_work"]
    return v + work if np.array_equal(connector, -work) else v


class Comparison(NamedTuple):
    """A printed vector beside the computed one, under the name of the quantity and its unit."""

    name: str
    unit: str
    printed: tuple[float, float, float]
    computed: tuple[float, float, float]


def comparisons_of(
    result: Result, reference: object, summary: Summary | None = None
) -> list[Comparison]:
    """The values of a config's `reference` beside those of its run.

    Args:
        result: The result.
        reference: The `Reference` of the config.
        summary: That of the result, where it is known already.
    """
    found = []
    final = getattr(reference, "final", None)
    for name in ("orientation", "angular_velocity", "position", "velocity"):
        printed = getattr(final, name, None)
        if printed is not None:
            variable = result.variables[name]
            x, y, z = variable.data[-1].tolist()
            computed = (x, y, z)
            found.append(Comparison(f"final {name}", variable.unit, printed, computed))
    printed = getattr(reference, "peak_contact_displacement", None)
    if printed is not None:
        computed = (summary or summary_of(result)).peak_contact_displacement
        found.append(Comparison("peak contact_displacement", "m", printed, computed))
    return found
