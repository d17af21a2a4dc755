"""Quantities of members that figures and tables show."""

from dataclasses import dataclass, replace

import numpy as np

from rbstab.analysis.lyapunov import DIGITS
from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis
from rbstab.report.sweeps.members import MOVING, OUTCOME_COLOURS, OUTCOMES, Members, kept

MIN_SPREAD = 0.01
"""Values that differ by less than this fraction of the largest one have no figure.

Gains, inertia and initial states of a real body are not known better than to about 1 %. A picture
of smaller differences would suggest a structure that decides nothing; the numbers are in tables.
"""

LOG_AXIS_RATIO = 30.0
"""The axis is logarithmic if the 98% quantile exceeds the 2% quantile by more than this factor."""


PEAK_LABEL = "largest |E1|, |E2| or |E3|"
"""The peak by which members are compared: of the components of E, and not of their norm |E|."""


@dataclass(frozen=True, eq=False)
class MemberQuantity:
    """A quantity with one number for each member.

    Args:
        name: A short name, part of the names of figures.
        axis: Its label and unit.
        values: Shape (n,); NaN where a member has no value.
        missing: Why a member that completed may have no value.
        later: The mask of members whose value is larger than `end`, but not known, shape (n,); None
            for none.
        end: The largest value that a member can have.
        is_share: Whether it is 1 for members with a property and 0 for others: its mean is shown.
        share: Of words, which have no mean: the label and the values of what is shown of several
            members in their place; None for others.
    """

    name: str
    axis: Axis
    values: Array
    missing: str = "no value"
    later: Array | None = None
    end: float = np.inf
    is_share: bool = False
    share: tuple[str, Array] | None = None

    @property
    def of_several(self) -> "MemberQuantity":
        """What is shown of several members together."""
        if self.share is None:
            return self
        label, values = self.share
        return replace(self, axis=Axis(label), values=values, is_share=True, share=None)

    @property
    def varies(self) -> bool:
        """Whether finite values differ enough for a figure: see `MIN_SPREAD`."""
        finite = self.values[np.isfinite(self.values)]
        least = 0.0 if self.axis.log else MIN_SPREAD
        return len(finite) > 0 and bool(np.ptp(finite) > least * np.abs(finite).max())

    @property
    def ranked(self) -> Array:
        """The values for quantiles, shape (n,): infinite where the value is later than the end.

        Without them a median would be that of the fast members only.
        """
        return self.values if self.later is None else np.where(self.later, np.inf, self.values)

    @property
    def note(self) -> str:
        """What a figure or a table of quantiles has to say of members without a value."""
        if self.later is None or not self.later.any():
            return ""
        return (
            f"Members that are not at rest by the end of their runs count as later than "
            f"{self.end:g} {self.axis.unit}; a quantile among them is drawn there."
        )


@kept
def outcome_words(members: Members) -> MemberQuantity:
    """Return the outcomes that occur; of several members, the share with the first of them."""
    occurring = np.flatnonzero(members.outcome_counts).tolist()
    words = tuple(OUTCOMES[code] for code in occurring)
    colours = tuple(OUTCOME_COLOURS[code] for code in occurring)
    codes = np.searchsorted(occurring, members.outcomes).astype(float)
    share = f"share: {words[0]}", (codes == 0).astype(float)
    return MemberQuantity(
        "outcome", Axis("outcome", categories=words, colours=colours), codes, share=share
    )


@kept
def settling_time(members: Members) -> MemberQuantity:
    """Return the time from which v stays below v(0)/1000, for completed members that settled."""
    values = np.where(members.completed, members.column("settling_time"), np.nan)
    quantity = _quantity("settling-time", "settling time of v", "s", values)
    later = members.completed & ~np.isfinite(values)
    plan = members.plan
    durations = [] if plan is None else [base.integration.duration for base in plan.bases.values()]
    end = max(durations, default=float(np.nanmax(quantity.values, initial=0.0)))
    return replace(quantity, missing=OUTCOMES[MOVING], later=later, end=float(end))


@kept
def final_tilt(members: Members) -> MemberQuantity:
    """Return the tilt of members at rest, or else at the end of their runs, in degrees."""
    tilts = np.degrees(members.column("final_tilt"))
    return MemberQuantity("final-tilt", Axis("final tilt", "°"), tilts, "no attitude at the end")


@kept
def peak_displacement(members: Members) -> MemberQuantity:
    """Return the largest |component of E| over time and axes, for completed members."""
    peaks = np.abs(members.column("peak_contact_displacement")).max(axis=1)
    values = np.where(members.completed, peaks, np.nan)
    return _quantity("peak-displacement", PEAK_LABEL, "m", values)


@kept
def regularity(members: Members) -> MemberQuantity:
    """Return the smallest cos θ2, also for members that left the range."""
    values = _finite(members.column("smallest_regularity"))
    return MemberQuantity("regularity", Axis("smallest cos θ2"), values)


@kept
def start_energy(members: Members) -> MemberQuantity:
    """Return v(0) of each member; zero where it is round-off: a body may start at rest."""
    values = members.column("lyapunov_start")
    if "energy_scale" in members.table:
        scale = members.column("energy_scale")
        values = np.where(np.abs(values) <= scale / DIGITS, 0.0, values)
    return _quantity("start-energy", "v(0)", "J", values)


@kept
def start_over_level(members: Members) -> MemberQuantity | None:
    """Return v(0) / c*, where c* is the proved level; None if no level is known."""
    if members.level is None:
        return None
    with np.errstate(all="ignore"):
        values = members.column("lyapunov_start") / members.level
    quantity = _quantity("start-over-level", "v(0) / c*", "", values)
    # Below 1 convergence is proved at the start.
    return replace(quantity, axis=replace(quantity.axis, middle=1.0), missing="no proof of c*")


@kept
def main_quantities(members: Members) -> tuple[MemberQuantity, ...]:
    """Return the quantities by which members are compared, if they have finite values."""
    quantities = settling_time(members), peak_displacement(members), regularity(members)
    return tuple(quantity for quantity in quantities if np.isfinite(quantity.values).any())


def _quantity(name: str, label: str, unit: str, values: Array) -> MemberQuantity:
    values = _finite(values)
    return MemberQuantity(name, Axis(label, unit, log=_is_wide(values)), values)


def _finite(values: Array) -> Array:
    return np.where(np.isfinite(values), values, np.nan)


def _is_wide(values: Array) -> bool:
    """Return whether all values are above 0 and span a wide range, outliers excluded."""
    finite = values[np.isfinite(values)]
    if not len(finite) or finite.min() <= 0:
        return False
    low, high = np.quantile(finite, [0.02, 0.98])
    return bool(low * LOG_AXIS_RATIO < high)
