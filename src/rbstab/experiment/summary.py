"""Summary of a run in a few numbers, and comparison with the values printed in a source."""

from decimal import Decimal
from typing import NamedTuple

import numpy as np

from rbstab.analysis.approached_state import SAME_STATE
from rbstab.analysis.extrema import ABSOLUTE
from rbstab.analysis.lyapunov import energy_scale
from rbstab.analysis.settling import moves_on
from rbstab.experiment.answers.rounded import TIME_DIGITS, rounded_up
from rbstab.experiment.convergence.enclosed_samples import GROUP
from rbstab.mechanics.attitude import rotations
from rbstab.mechanics.numbers import Array
from rbstab.store.result import Result

RESOLVED = 0.01
"""The largest error of a peak that is shown as such, relative to the peak."""


STILL = 1e-6
"""A body stands still if its kinetic energy stays below this share of the largest one."""


class Summary(NamedTuple):
    """A run in a few numbers.

    They are v at both ends, J; the largest energy residual |r| over `energy_scale`; the largest
    |E|, m; the value of E farthest from zero by axis, m; the largest |θ2|, rad; and the last time
    reached, s. Where the error of a peak is large or unknown, `displacement_resolved` (of E) or
    `pitch_resolved` (of θ2) is false.
    """

    lyapunov_start: float
    lyapunov_end: float
    relative_residual: float
    peak_distance: float
    peak_contact_displacement: tuple[float, ...]
    largest_pitch: float
    end_time: float
    displacement_resolved: bool
    pitch_resolved: bool

    @property
    def resolved(self) -> bool:
        """Whether the errors of all peaks are small."""
        return self.displacement_resolved and self.pitch_resolved


UNKNOWN_STEPS = "some steps of the run are not known"
"""Why a peak has ≥, and a settling time ≤: only samples, or the ends of joined steps, are known."""


def at_least(resolved: bool) -> str:
    """Return what stands before a peak: nothing, or ≥ if the true one may be farther from zero."""
    return "" if resolved else "≥ "


def summary_of(result: Result) -> Summary:
    """Return the summary of a result, from its stored arrays only."""
    v = lyapunov_function_of(result)
    supplied = result["supplied_energy"] if is_driven(result) else None
    with np.errstate(all="ignore"):
        scale = energy_scale(result["lyapunov"], result["energy_round_off"], supplied)
        peaks, are_shown = _peak(result, "peak_contact_displacement")
        (farthest,), is_shown = _peak(result, "peak_distance")
        (pitch,), pitch_shown = _peak(result, "largest_pitch")
    return Summary(
        float(v[0]),
        float(v[-1]),
        float(np.abs(result["energy_residual"]).max() / scale),
        farthest,
        peaks,
        pitch,
        float(result["time"][-1]),
        are_shown and is_shown,
        pitch_shown,
    )


def _peak(result: Result, name: str) -> tuple[tuple[float, ...], bool]:
    """Return the components of a stored peak, and whether their errors are small."""
    peak, error = (np.atleast_1d(result[entry]) for entry in (name, f"{name}_error"))
    # Where a quantity is no number, its peak is none, and no sample would help.
    shown = (error <= np.maximum(RESOLVED * np.abs(peak), ABSOLUTE)) | np.isnan(peak)
    return tuple(peak.tolist()), bool(shown.all())


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
    without damping, however small v is. If elements supply power, the largest v takes the place of
    v(0).
    """
    return np.nan if moves_on_in(result) else float(result["settling_time"])


def at_rest_from(result: Result) -> str:
    """Return the settling time as text, s: with ≤ if its error shows in it; "" without one."""
    settled, error = settling_time_of(result), float(result["settling_time_error"])
    if np.isnan(settled):
        return ""
    if error <= 0.5 * 10.0 ** (1 - TIME_DIGITS) * settled:
        return f"{settled:.{TIME_DIGITS}g}"
    return f"≤ {rounded_up(settled + error)}"


def moves_on_in(result: Result) -> bool:
    """Return whether the body of a run moves on without damping, see `moves_on`."""
    if is_driven(result):
        return False
    v, noise = lyapunov_function_of(result), float(result["energy_round_off"])
    return moves_on(result["time"], v, _kinetic_energy(result), noise)


NO_REST_STATE = "no rest state was found in the range of eq. 5"
"""The begin of the text that names the rest state at which v is zero, if none was found."""


def stands_still(result: Result) -> bool:
    """Return whether a body stands still over the last tenth of its run, where v does not tell it.

    Inputs may hold it, as a load does, or no rest state was found, as at θ2 = ±90°. Its kinetic
    energy is below `STILL` of the largest one, and it moves by less than `SAME_STATE`.
    """
    zero = str(result.attributes.get("lyapunov_zero", ""))
    if not is_driven(result) and not zero.startswith(NO_REST_STATE):
        return False
    kinetic = _kinetic_energy(result)
    late = result["time"] >= 0.9 * result["time"][-1]
    with np.errstate(all="ignore"):
        places = rotations(result["orientation"][late]), result["position"][late]
        moved = [np.ptp(place, axis=0).max() for place in places]
        return bool(kinetic[late].max() <= STILL * kinetic.max() and max(moved) < SAME_STATE)


def _kinetic_energy(result: Result) -> Array:
    """Return the kinetic energy, shape (n,), J."""
    return result["energy"][:, result["part"].tolist().index("kinetic")]


def is_driven(result: Result) -> bool:
    """Return whether elements supply power to the body of a run."""
    return "supplied_energy" in result


class ReferenceValue(NamedTuple):
    """A printed vector and the computed one, with the name and unit of the quantity.

    exact has the smallest and the largest value that the exact motion can have, by component, if it
    was enclosed to the end of the run.
    """

    name: str
    unit: str
    printed: tuple[float, ...]
    computed: tuple[float, ...]
    exact: tuple[tuple[float, ...], ...] | None = None

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


def _exact_end(result: Result, name: str) -> tuple[tuple[float, ...], ...] | None:
    """Return bounds on a quantity of the exact motion at the end, if the run has them."""
    low, high, time = (f"{GROUP}/{entry}" for entry in (f"{name}_low", f"{name}_high", "time"))
    if low not in result or result[time][-1] != result["time"][-1]:
        return None
    return tuple(tuple(result[end][-1].tolist()) for end in (low, high))


def reference_values_of(
    result: Result, reference: object, summary: Summary | None = None
) -> list[ReferenceValue]:
    """Return the printed values of a config's `reference`, each with the computed value of its run.

    Args:
        result: The result.
        reference: The `Reference` of the config.
        summary: The summary of the result, if the caller has it.
    """
    values, final = [], getattr(reference, "final", None)
    for name in ("orientation", "angular_velocity", "position", "velocity"):
        printed = getattr(final, name, None)
        if printed is not None:
            end, unit = tuple(result[name][-1].tolist()), result.variables[name].unit
            exact = _exact_end(result, name)
            values.append(ReferenceValue(f"final {name}", unit, printed, end, exact))
    printed = getattr(reference, "peak_contact_displacement", None)
    if printed is not None:
        computed = (summary or summary_of(result)).peak_contact_displacement
        values.append(ReferenceValue("peak contact_displacement", "m", printed, computed))
    return values
