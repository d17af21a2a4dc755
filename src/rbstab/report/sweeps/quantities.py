"""The numbers of members that maps, curves and distributions show."""

from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis
from rbstab.report.sweeps.members import Members

WIDE = 30.0
"""The ratio of large to small numbers from which on their axis is logarithmic."""


@dataclass(frozen=True, eq=False)
class Quantity:
    """A number of each member.

    Args:
        name: Short, for names of figures.
        axis: What it is.
        values: Shape (n,); NaN where a member has none.
    """

    name: str
    axis: Axis
    values: Array


def settling_time(members: Members) -> Quantity:
    """When v falls below a thousandth of v(0) for good, of those that settled."""
    values = np.where(members.completed, members.column("settling_time"), np.nan)
    return _quantity("settling-time", "settling time of v", "s", values)


def peak_displacement(members: Members) -> Quantity:
    """The largest entry of |E| over time and axes, of members that completed."""
    peaks = np.abs(members.column("peak_contact_displacement")).max(axis=1)
    values = np.where(members.completed, peaks, np.nan)
    return _quantity("peak-displacement", "max |E| by axis", "m", values)


def regularity(members: Members) -> Quantity:
    """The smallest cos θ2, also of members that left the range."""
    values = _finite(members.column("smallest_regularity"))
    return Quantity("regularity", Axis("smallest cos θ2"), values)


def start_energy(members: Members) -> Quantity:
    """v(0)."""
    return _quantity("start-energy", "v(0)", "J", members.column("lyapunov_start"))


def start_over_level(members: Members) -> Quantity | None:
    """v(0) over the level up to which convergence is proved; None where that is not known."""
    if members.level is None:
        return None
    with np.errstate(all="ignore"):
        values = members.column("lyapunov_start") / members.level
    return _quantity("start-over-level", "v(0) / c*", "", values)


def mapped(members: Members) -> list[Quantity]:
    """The quantities of maps and curves that have any numbers."""
    found = [settling_time(members), peak_displacement(members), regularity(members)]
    found.append(start_over_level(members) or start_energy(members))
    return [quantity for quantity in found if np.isfinite(quantity.values).any()]


def varies(values: Array) -> bool:
    """Whether there are different finite numbers, by more than round-off."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return False
    return bool(np.ptp(finite) > 1e-9 * np.abs(finite).max())


def _quantity(name: str, label: str, unit: str, values: Array) -> Quantity:
    values = _finite(values)
    return Quantity(name, Axis(label, unit, log=_is_wide(values)), values)


def _finite(values: Array) -> Array:
    return np.where(np.isfinite(values), values, np.nan)


def _is_wide(values: Array) -> bool:
    """Whether all are above 0, and most of them far apart; a few of them alone do not matter."""
    finite = values[np.isfinite(values)]
    if not len(finite) or finite.min() <= 0:
        return False
    low, high = np.quantile(finite, [0.02, 0.98])
    return bool(low * WIDE < high)
