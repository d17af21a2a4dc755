"""How the numbers of members are distributed."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block, Cell, Head, Table
from rbstab.report.model.figure import Axis, Bars, Figure, Panel
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.quantities import Quantity, regularity, settling_time, varies
from rbstab.report.sweeps.table_entries import number, whole

QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)

MAX_BARS = 60

AXES = ("first axis", "second axis", "third axis")


def distribution_blocks(name: str, members: Members) -> list[Block]:
    """A table of quantiles, and histograms of what varies."""
    found = distributed(members)
    if not found:
        return ["No member completed, so that there are no numbers to be shown."]
    heads = (
        Head("quantity"),
        Head("unit"),
        Head("members", numbers=True),
        *(Head(_said(q), numbers=True) for q in QUANTILES),
    )
    table = Table(
        f"{name}-quantiles",
        "Quantiles of the members' numbers",
        heads,
        tuple(_row(quantity) for quantity in found),
        "Of members that completed; the smallest cos θ2 also of those that left the range.",
    )
    panels = tuple(_panel(quantity) for quantity in found if varies(quantity.values))
    if not panels:
        return [table]
    return [table, Figure(f"{name}-histograms", "Distributions over the members", panels, 2)]


def distributed(members: Members) -> list[Quantity]:
    """The quantities whose distributions are shown, those without any numbers left out."""
    done = members.completed
    peaks, angles = (
        members.column(name) for name in ("peak_contact_displacement", "peak_orientation")
    )
    start = members.column("lyapunov_start")
    with np.errstate(all="ignore"):
        relative = members.column("energy_residual") / np.where(start > 0, start, np.nan)
    found = [
        settling_time(members),
        *(
            Quantity(f"peak-{k + 1}", Axis(f"peak of E, {label}", "m"), _of(done, peaks[:, k]))
            for k, label in enumerate(AXES)
        ),
        regularity(members),
        Quantity("pitch", Axis("largest |θ2|", "rad"), _of(done, angles[:, 1])),
        Quantity("residual", Axis("max |r| / v(0)", log=True), _of(done, relative)),
        Quantity("steps", Axis("accepted steps"), _of(done, members.column("steps"))),
    ]
    return [quantity for quantity in found if np.isfinite(quantity.values).any()]


def quantiles_of(values: Array, at: tuple[float, ...] = QUANTILES) -> list[float]:
    """Quantiles of the finite numbers; NaN where there are none."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return [float("nan")] * len(at)
    found: list[float] = np.quantile(finite, at).tolist()
    return found


def histogram(values: Array, *, log: bool) -> Bars:
    """The bars of the finite numbers (on a logarithmic axis: of those above 0)."""
    chosen = values[np.isfinite(values) & ((values > 0) | (not log))]
    scaled = np.log10(chosen) if log else chosen
    count = int(np.clip(np.sqrt(len(scaled)), 5, MAX_BARS))
    heights, edges = np.histogram(scaled, bins=count)
    return Bars(10.0**edges if log else edges, heights.astype(float))


def _of(chosen: Array, values: Array) -> Array:
    return np.where(chosen & np.isfinite(values), values, np.nan)


def _said(quantile: float) -> str:
    return {0.0: "least", 0.5: "median", 1.0: "greatest"}.get(quantile, f"{quantile:.0%}")


def _row(quantity: Quantity) -> tuple[Cell, ...]:
    counted = int(np.isfinite(quantity.values).sum())
    numbers = (number(value) for value in quantiles_of(quantity.values))
    return (Cell(quantity.axis.label), Cell(quantity.axis.unit), whole(counted), *numbers)


def _panel(quantity: Quantity) -> Panel:
    bars = histogram(quantity.values, log=quantity.axis.log)
    return Panel(quantity.axis, Axis("members"), (bars,))
