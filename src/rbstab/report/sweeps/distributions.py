"""Distributions of quantities over the members of a sweep.

Members of different conditions are never one distribution: how often a value occurs would then
depend on how many members of each condition the plan has. Each condition has a curve of its own.
"""

import numpy as np

from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block, Cell, Head, Table
from rbstab.report.model.figure import SHARE_ENDS, Axis, Bars, Figure, Line, Panel
from rbstab.report.sweeps.conditions.paired_conditions import PairedConditions, paired_conditions_of
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.quantities import MemberQuantity, regularity, settling_time, varies
from rbstab.report.sweeps.table_entries import number, whole
from rbstab.sweep.folder.members_file import relative_residuals

QUANTILES = (0.5, 0.05, 0.95, 0.0, 1.0)
"""Orders of the quantiles; the median comes first: a narrow page shows only the first columns."""

NOTE = "Only completed members count. The smallest cos θ2 includes members that left the range."

RESIDUAL_AXIS = Axis(f"max |r| / {ENERGY_SCALE}", log=True)

MAX_BARS = 60

MAX_CURVES = 7
"""If there are more conditions, their curves are not drawn: more colours cannot be told apart."""

CURVE_ORDERS = np.linspace(0.0, 1.0, 201)
"""Orders of the quantiles that a curve has as its points."""


def distribution_blocks(name: str, members: Members) -> list[Block]:
    """Return a table of quantiles of each quantity, and histograms of the quantities that vary.

    For several conditions, return the cumulative distributions of each.
    """
    quantities = distributed(members)
    if not quantities:
        return ["No member completed, so there are no values to show."]
    groups = paired_conditions_of(members)
    if groups is not None:
        return _by_condition(name, quantities, groups)
    heads = (
        Head("quantity"),
        Head("unit"),
        *(Head(_quantile_name(q), numbers=True) for q in QUANTILES),
        Head("members", numbers=True),
    )
    table = Table(
        f"{name}-quantiles",
        "Quantiles over the members",
        heads,
        tuple(_row(quantity) for quantity in quantities),
        " ".join([NOTE, *(quantity.note for quantity in quantities if quantity.note)]),
    )
    panels = tuple(_panel(quantity) for quantity in quantities if varies(quantity.values))
    if not panels:
        return [table]
    return [table, Figure(f"{name}-histograms", "Distributions over the members", panels, 2)]


def _by_condition(
    name: str, quantities: list[MemberQuantity], groups: PairedConditions
) -> list[Block]:
    """Return the cumulative distributions of each condition, one panel for each quantity."""
    if len(groups.labels) > MAX_CURVES:
        return [
            f"{len(groups.labels)} conditions have too many curves for a figure; the comparison "
            "has their quantiles."
        ]
    panels = tuple(
        Panel(q.axis, Axis("share of members", ends=SHARE_ENDS), _curves(q, groups))
        for q in quantities
        if varies(q.values)
    )
    if not panels:
        return ["All members have the same values."]
    caption = (
        "At each value: the share of the members of a condition that have this value or a smaller "
        "one. A curve that ends below 1 has members without a value."
    )
    title = "Distributions by condition"
    return [Figure(f"{name}-cumulative", title, panels, 2, caption=caption)]


def _curves(quantity: MemberQuantity, groups: PairedConditions) -> tuple[Line, ...]:
    """Return the empirical distribution function of each condition that has values."""
    curves = []
    for k, label in enumerate(groups.labels):
        own = quantity.values[groups.codes == k]
        finite = own[np.isfinite(own)]
        if len(finite):
            x = np.quantile(finite, CURVE_ORDERS, method="inverted_cdf")
            y = CURVE_ORDERS * len(finite) / len(own)
            curves.append(Line(x, y, label, colour=k))
    return tuple(curves)


def distributed(members: Members) -> list[MemberQuantity]:
    """Return the quantities to show; each has at least one finite value."""
    completed, residuals = members.completed, relative_residuals(members.table)
    peaks, angles = (
        members.column(name) for name in ("peak_contact_displacement", "peak_orientation")
    )
    quantities = [
        settling_time(members),
        *(
            MemberQuantity(
                f"peak-{k + 1}", Axis(f"largest |E{k + 1}|", "m"), _masked(completed, peak)
            )
            for k, peak in enumerate(np.abs(peaks).T)
        ),
        regularity(members),
        MemberQuantity("pitch", Axis("largest |θ2|", "rad"), _masked(completed, angles[:, 1])),
        MemberQuantity("residual", RESIDUAL_AXIS, _masked(completed, residuals)),
        MemberQuantity(
            "steps", Axis("accepted steps", whole=True), _masked(completed, members.column("steps"))
        ),
    ]
    return [quantity for quantity in quantities if np.isfinite(quantity.values).any()]


def quantiles_of(values: Array, orders: tuple[float, ...] = QUANTILES) -> list[float]:
    """Return quantiles of the values that are not NaN; NaN if there are none.

    Among infinite values, which are larger than all others, nothing is interpolated.
    """
    known = values[~np.isnan(values)]
    if not len(known):
        return [float("nan")] * len(orders)
    if np.isfinite(known).all():
        quantiles: list[float] = np.quantile(known, orders).tolist()
        return quantiles
    found: list[float] = np.quantile(known, orders, method="inverted_cdf").tolist()
    return found


def histogram(values: Array, *, log: bool) -> Bars:
    """Return the histogram of the finite values.

    With `log`, the bins are logarithmic, and only values above 0 count.
    """
    chosen = values[np.isfinite(values) & ((values > 0) | (not log))]
    scaled = np.log10(chosen) if log else chosen
    bars = int(np.clip(np.sqrt(len(scaled)), 5, MAX_BARS))
    bins: int | Array = bars
    if len(chosen) and not log and np.array_equal(chosen, np.round(chosen)):
        bins = _whole_edges(chosen, bars)
    heights, edges = np.histogram(scaled, bins=bins)
    return Bars(10.0**edges if log else edges, heights.astype(float))


def _whole_edges(values: Array, bars: int) -> Array:
    """Return the edges of bars that hold equally many whole numbers, so that none is left empty.

    Args:
        values: Whole numbers, shape (n,).
        bars: The largest number of bars.
    """
    low, high = float(values.min()), float(values.max())
    width = max(1.0, np.ceil((high - low + 1.0) / bars))
    return np.arange(low - 0.5, high + width + 0.5, width)


def _masked(chosen: Array, values: Array) -> Array:
    return np.where(chosen & np.isfinite(values), values, np.nan)


def _quantile_name(quantile: float) -> str:
    return {0.0: "minimum", 0.5: "median", 1.0: "maximum"}.get(quantile, f"{quantile:.0%}")


def _row(quantity: MemberQuantity) -> tuple[Cell, ...]:
    counted = int((~np.isnan(quantity.ranked)).sum())
    numbers = (number(value) for value in quantiles_of(quantity.ranked))
    return (Cell(quantity.axis.label), Cell(quantity.axis.unit), *numbers, whole(counted))


def _panel(quantity: MemberQuantity) -> Panel:
    bars = histogram(quantity.values, log=quantity.axis.log)
    return Panel(quantity.axis, Axis("members", whole=True), (bars,))
