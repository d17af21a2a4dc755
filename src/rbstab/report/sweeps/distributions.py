"""Distributions of quantities over the members of a sweep.

Members of different conditions are never one distribution: how often a value occurs would then
depend on how many members of each condition the plan has. Each condition has a curve of its own.
"""

import numpy as np

from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.report.model.document import Block, Cell, Head, Table
from rbstab.report.model.figure import SHARE_ENDS, Axis, Figure, Line, Panel
from rbstab.report.sweeps.conditions.paired_conditions import Slice, slices_of
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.quantiles import quantiles_of
from rbstab.report.sweeps.quantities import MemberQuantity, main_quantities
from rbstab.report.sweeps.table_entries import by_condition, number, whole
from rbstab.sweep.folder.members_file import relative_residuals

QUANTILES = {"median": 0.5, "5%": 0.05, "95%": 0.95, "minimum": 0.0, "maximum": 1.0}
"""Orders of the quantiles; the median comes first: a narrow page shows only the first columns."""

NOTE = "Only completed members count. The smallest cos θ2 includes members that left the range."

MAX_CURVES = 7
"""If there are more conditions, their curves are not drawn: more colours cannot be told apart."""

CURVE_ORDERS = np.linspace(0.0, 1.0, 201)
"""Orders of the quantiles that a curve has as its points."""

CAPTION = (
    "At each value: the share of members that have this value or a smaller one. A curve that ends "
    "below 1 has members without a value."
)


def spread_figures(name: str, members: Members) -> list[Figure]:
    """Return the cumulative distributions of drawn members, or of each condition.

    How often a value occurs in a grid only says how its points were chosen.
    """
    slices = slices_of(members)
    if not (members.is_drawn or len(slices) > 1) or len(slices) > MAX_CURVES:
        return []
    y = Axis("share of members", ends=SHARE_ENDS)
    shown = [quantity for quantity in main_quantities(members) if quantity.varies]
    panels = tuple(Panel(q.axis, y, _curves(q, slices)) for q in shown)
    title = "Distributions over the members"
    return [Figure(f"{name}-cumulative", title, panels, 3, caption=CAPTION)] if panels else []


def _curves(quantity: MemberQuantity, slices: list[Slice]) -> tuple[Line, ...]:
    """Return the empirical distribution function of each condition that has values."""
    curves = []
    for k, part in enumerate(slices):
        own = quantity.values[part.chosen]
        finite = own[np.isfinite(own)]
        if len(finite):
            x = np.quantile(finite, CURVE_ORDERS, method="inverted_cdf")
            y = CURVE_ORDERS * len(finite) / len(own)
            curves.append(Line(x, y, part.title, colour=k))
    return tuple(curves)


def quantile_table(name: str, members: Members) -> Block:
    """Return quantiles of the members, of each condition if there are several."""
    residuals = np.where(members.completed, relative_residuals(members.table), np.nan)
    residual = MemberQuantity("residual", Axis(f"max |r| / {ENERGY_SCALE}"), residuals)
    quantities = [q for q in (*main_quantities(members), residual) if np.isfinite(q.values).any()]
    if not quantities:
        return "No member completed, so there are no values to show."
    slices = slices_of(members)
    heads = [Head("quantity"), Head("condition")]
    heads += [Head(label, numbers=True) for label in (*QUANTILES, "members")]
    rows = []
    for quantity in quantities:
        for part in slices:
            own = quantity.ranked[part.chosen]
            numbers = map(number, quantiles_of(own, (*QUANTILES.values(),)))
            count = whole(int(np.count_nonzero(~np.isnan(own))))
            rows.append((Cell(quantity.axis.text), Cell(part.title), *numbers, count))
    note = " ".join([NOTE, *(q.note for q in quantities if q.note)])
    title = "Quantiles over the members"
    return by_condition(Table(f"{name}-quantiles", title, tuple(heads), tuple(rows), note))
