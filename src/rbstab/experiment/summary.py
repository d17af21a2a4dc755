"""Summary of a run in a few numbers, and comparison with the values printed in a source."""

from decimal import Decimal
from typing import NamedTuple

import numpy as np

from rbstab.analysis.hermite import hermite_table
from rbstab.analysis.lyapunov import energy_scale
from rbstab.analysis.peak_search import (
    ABSOLUTE,
    STEPS_PER_INTERVAL,
    Samples,
    find_peaks,
    peaks_of_cubics,
)
from rbstab.analysis.settling import moves_on, settling_times
from rbstab.experiment.answers.rounded import TIME_DIGITS, rounded_up
from rbstab.experiment.convergence.enclosed_samples import GROUP
from rbstab.mechanics.attitude import angle_rates
from rbstab.mechanics.numbers import Array
from rbstab.store.result import Result

RESOLVED = 0.01
"""The largest error of a peak between samples, relative to the peak; else the sample is taken."""

ROUND_OFF = 1e-9
"""A quantity is constant if between samples it changes by at most this times its largest value."""

KINETIC = "kinetic"
"""The name of the kinetic energy among the parts of the energy of a result."""


class Summary(NamedTuple):
    """A run in a few numbers.

    They are v at both ends, J; the largest energy residual |r| over `energy_scale`; the largest
    |E|, m; the value of E farthest from zero by axis, m; the largest |θ2|, rad; and the last time
    reached, s. Peaks between the samples are included where the samples show them. Where they do
    not, because the motion is too fast for them, a peak is the sample farthest from zero, and
    `displacement_resolved` (of E) or `pitch_resolved` (of θ2) is false.
    """

    lyapunov_start: float
    lyapunov_end: float
    relative_residual: float
    peak_distance: float
    peak_contact_displacement: tuple[float, float, float]
    largest_pitch: float
    end_time: float
    displacement_resolved: bool
    pitch_resolved: bool

    @property
    def resolved(self) -> bool:
        """Whether the samples show all peaks."""
        return self.displacement_resolved and self.pitch_resolved


def at_least(resolved: bool) -> str:
    """Return what stands before a peak: nothing, or ≥ if the true one may be farther from zero."""
    return "" if resolved else "≥ "


def summary_of(result: Result) -> Summary:
    """Return the summary of a result, from its stored arrays only."""
    t, v = result["time"], result["lyapunov"]
    supplied = result["supplied_energy"] if is_driven(result) else None
    E, F = result["contact_displacement"], result["contact_velocity"]
    Theta, Omega = result["orientation"], result["angular_velocity"]
    with np.errstate(all="ignore"):
        distance = np.linalg.norm(E, axis=1)
        distance_rate = (E * F).sum(axis=1) / np.where(distance > 0, distance, 1.0)
        values = np.array([*E.T, distance, Theta[:, 1]])
        rates = np.array([*F.T, distance_rate, angle_rates(Theta, Omega)[:, 1]])
        (x, y, z, farthest, pitch), shown = _peaks(t, values, rates, _has_fast_steps(result))
    largest_pitch, at_stop = _largest_pitch(result, abs(pitch))
    scale = energy_scale(v, _round_off(result), supplied)
    return Summary(
        float(v[0]),
        float(v[-1]),
        float(np.abs(result["energy_residual"]).max() / scale),
        abs(farthest),
        (x, y, z),
        largest_pitch,
        float(t[-1]),
        all(shown[:-1]),
        shown[-1] or at_stop,
    )


def _has_fast_steps(result: Result) -> bool:
    """Return whether a run took so many steps that its samples may not show all turning points."""
    most = STEPS_PER_INTERVAL.get(str(result.attributes.get("engine")), 1)
    steps = result.attributes.get("steps")
    return steps is None or int(steps) > most * (len(result["time"]) - 1)


def _peaks(times: Array, values: Array, rates: Array, fast: bool) -> tuple[list[float], list[bool]]:
    """Return the value of each quantity farthest from zero, and whether the samples show it.

    Args:
        times: Shape (n,), s.
        values: Shape (q, n).
        rates: Their derivatives, shape (q, n).
        fast: Whether the motion may turn more often than the samples show.
    """
    largest = values[np.arange(len(values)), np.abs(values).argmax(axis=1)]
    if len(times) == 1:
        return largest.tolist(), [True] * len(values)
    # The sign of a rate that is round-off says nothing: such a quantity is constant.
    change = np.diff(times).max() * np.abs(rates).max(axis=1, keepdims=True)
    constant = change <= ROUND_OFF * np.abs(largest)[:, np.newaxis]
    slopes = np.where(constant, 0.0, rates)
    samples = Samples(times, values[:, np.newaxis], slopes[:, np.newaxis])
    cubics = peaks_of_cubics(samples)
    found = find_peaks(samples, cubics=cubics)
    peak, error = found.value[:, 0], found.error[:, 0]
    tolerance = np.maximum(RESOLVED * np.abs(peak), ABSOLUTE)
    # Without an estimate, two interpolants have to agree, and no turn may be hidden. A cubic stays
    # within the hull of its Bézier points.
    step = np.diff(times) / 3.0
    points = values[:, :-1] + step * slopes[:, :-1], values[:, 1:] - step * slopes[:, 1:]
    within = np.abs(points).max(axis=(0, 2)) <= np.abs(peak) + tolerance
    agree = np.abs(peak - cubics.value[:, 0]) <= tolerance
    resolved = (error <= tolerance) | (agree & within & (not fast))
    # Where a quantity is no number, its peak is none, however many samples there are.
    shown = resolved | np.isnan(largest)
    return np.where(resolved, peak, largest).tolist(), shown.tolist()


def _largest_pitch(result: Result, at_samples: float) -> tuple[float, bool]:
    """Return the largest |θ2|, rad, and whether it is the angle of a stop that was met."""
    if "stop_angle" not in result:
        return at_samples, False
    met = bool(result["impact_count"][-1] > 0 or result["stop_contact"].any())
    angle = float(result["stop_angle"])
    return (angle if met else min(at_samples, angle)), met


def lyapunov_function_of(result: Result) -> Array:
    """Return v, shape (n,), J. If the result stores v - ε (on s = F + κE), ε is added.

    v - ε does not end at zero, so only v shows whether a motion has settled.
    """
    v, parts = result["lyapunov"], result["part"].tolist()
    if result.attributes.get("variant") != "sliding" or "connector" not in parts:
        return v
    connector, work = result["energy"][:, parts.index("connector")], result["contact_work"]
    return v + work if np.array_equal(connector, -work) else v


def stores_v_minus_work(result: Result) -> bool:
    """Return whether a result stores v - ε in place of v (on s = F + κE)."""
    return not np.array_equal(lyapunov_function_of(result), result["lyapunov"], equal_nan=True)


def settling_time_of(result: Result) -> float:
    """Return the time from which v stays below v(0)/1000, s; NaN if the run has not settled.

    A run that starts at rest has settled from t = 0 on. A run has not settled if the body moves on
    without damping, however small v is. If inputs supply power, the largest v takes the place of
    v(0). Then v may have been above this bound within the interval before that time: by what was
    supplied there.
    """
    with np.errstate(all="ignore"):
        v, last = lyapunov_function_of(result), result["orientation"][-1]
        # Runs of before layout version 2 do not name the rest state at which their v is zero.
        is_known = "rest_orientation" in result
        rest = result["rest_orientation"] if is_known else last
        away = (last - rest)[np.newaxis]
        supplied = result["supplied_energy"][np.newaxis] if is_driven(result) else None
        round_off = np.array([_round_off(result)])
        found = settling_times(result["time"], v[np.newaxis], away, round_off, supplied)
    return np.nan if moves_on_in(result) else float(found[0])


def at_rest_from(result: Result) -> str:
    """Return the settling time as text, s: with ≤ if the samples do not resolve it; "" without one.

    The bound is the first sample from which v stays below its level.
    """
    settled = settling_time_of(result)
    if np.isnan(settled):
        return ""
    if _settling_resolved(result, settled):
        return f"{settled:.{TIME_DIGITS}g}"
    times = result["time"]
    return f"≤ {rounded_up(float(times[np.searchsorted(times, settled)]))}"


def _settling_resolved(result: Result, settled: float) -> bool:
    """Return whether the samples show a settling time to `TIME_DIGITS` digits.

    Either the samples beside it are so close, or the motion is not faster than they are and two
    interpolants of v between them agree.
    """
    times, v = result["time"], lyapunov_function_of(result)
    after = int(np.searchsorted(times, settled))
    error = 0.5 * 10.0 ** (1 - TIME_DIGITS) * settled
    if after == 0 or times[after] - times[after - 1] <= error:
        return True
    if stores_v_minus_work(result) or is_driven(result) or _has_fast_steps(result):
        return False
    pair = slice(after - 1, after + 1)
    columns = (one[pair, np.newaxis] for one in (times, v, result["lyapunov_rate"]))
    cubic = hermite_table(*columns).through(0, 2)
    before, beyond = (cubic.values_at(np.array([settled + x])) for x in (-error, error))
    return bool(before[0] > np.interp(settled, times, v) > beyond[0])


def moves_on_in(result: Result) -> bool:
    """Return whether the body of a run moves on without damping, see `moves_on`."""
    parts = result["part"].tolist()
    if is_driven(result) or KINETIC not in parts:
        return False
    kinetic = result["energy"][:, parts.index(KINETIC)]
    v, round_off = lyapunov_function_of(result), _round_off(result)
    return moves_on(result["time"], v, kinetic, round_off)


def _round_off(result: Result) -> float:
    """Return the energy below which v is round-off, J; runs before layout version 4 have none."""
    name = "energy_round_off"
    return float(result[name]) if name in result else float(np.finfo(float).tiny)


def is_driven(result: Result) -> bool:
    """Return whether inputs supply power to the body of a run."""
    return "supplied_energy" in result


Triple = tuple[float, float, float]


class ReferenceValue(NamedTuple):
    """A printed vector and the computed one, with the name and unit of the quantity.

    exact has the smallest and the largest value that the exact motion can have, by component, if it
    was enclosed to the end of the run.
    """

    name: str
    unit: str
    printed: Triple
    computed: Triple
    exact: tuple[Triple, Triple] | None = None

    @property
    def disproved(self) -> bool:
        """Whether the printed value is proved not to be that of the exact motion.

        A printed number stands for all numbers that round to its digits.
        """
        if self.exact is None:
            return False
        bounds = zip(self.printed, *self.exact, strict=True)
        return any(p + half_unit(p) < low or p - half_unit(p) > high for p, low, high in bounds)


def half_unit(printed: float) -> float:
    """Return half a unit of the last digit of a printed number, rounded up.

    A whole number may have been printed without a point, so its last digit is that of the units.
    """
    exponent = 0 if printed == round(printed) else int(Decimal(repr(printed)).as_tuple().exponent)
    return 0.5000001 * 10.0**exponent


def _exact_end(result: Result, name: str) -> tuple[Triple, Triple] | None:
    """Return bounds on a quantity of the exact motion at the end, if the run has them."""
    time, low, high = (f"{GROUP}/{entry}" for entry in ("time", f"{name}_low", f"{name}_high"))
    if any(entry not in result for entry in (time, low, high)):
        return None
    if result[time][-1] != result["time"][-1]:
        return None
    (a, b, c), (d, e, f) = result[low][-1].tolist(), result[high][-1].tolist()
    return (a, b, c), (d, e, f)


def reference_values_of(
    result: Result, reference: object, summary: Summary | None = None
) -> list[ReferenceValue]:
    """Return the printed values of a config's `reference`, each with the computed value of its run.

    Args:
        result: The result.
        reference: The `Reference` of the config.
        summary: The summary of the result, if the caller has it.
    """
    values = []
    final = getattr(reference, "final", None)
    for name in ("orientation", "angular_velocity", "position", "velocity"):
        printed = getattr(final, name, None)
        if printed is not None:
            variable = result.variables[name]
            x, y, z = variable.data[-1].tolist()
            exact = _exact_end(result, name)
            values.append(ReferenceValue(f"final {name}", variable.unit, printed, (x, y, z), exact))
    printed = getattr(reference, "peak_contact_displacement", None)
    if printed is not None:
        computed = (summary or summary_of(result)).peak_contact_displacement
        values.append(ReferenceValue("peak contact_displacement", "m", printed, computed))
    return values
