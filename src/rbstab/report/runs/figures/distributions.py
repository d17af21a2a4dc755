"""How the outcomes of many runs are spread."""

from collections.abc import Sequence

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Bars, Figure, Panel
from rbstab.report.reading.sources import Run

MAX_BARS = 40


def distribution_figure(runs: Sequence[Run]) -> Figure:
    """Histograms of settling time, peak |E|, v(end)/v(0) and residual."""
    summaries = [run.summary for run in runs]
    with np.errstate(all="ignore"):
        left = [s.lyapunov_end / np.float64(s.lyapunov_start) for s in summaries]
    outcomes = (
        (Axis("settling time", "s"), [run.settling_time for run in runs]),
        (Axis("peak |E|", "m"), [s.peak_distance for s in summaries]),
        (Axis("v(end) / v(0)", log=True), left),
        (Axis("largest |r| / v(0)", log=True), [s.relative_residual for s in summaries]),
    )
    panels, missing = [], []
    for axis, values in outcomes:
        shown = _shown(np.array(values, dtype=float), axis)
        panels.append(_histogram(shown, axis))
        if len(shown) < len(runs):
            missing.append(f"{axis.label}: {len(runs) - len(shown)}")
    caption = (
        "A motion has settled once v stays below v(0)/1000, between the samples by a straight line."
    )
    if missing:
        caption += f" Runs that are not drawn, for they have no such number: {'; '.join(missing)}."
    return Figure(
        "runs-distributions", f"Outcomes of {len(runs)} runs", tuple(panels), 2, caption=caption
    )


def _shown(values: Array, axis: Axis) -> Array:
    values = values[np.isfinite(values)]
    return values[values > 0] if axis.log else values


def _histogram(values: Array, axis: Axis) -> Panel:
    count = Axis("runs")
    if not len(values):
        return Panel(axis, count, ())
    # As many bars as tell a normal distribution best (Sturges' rule undersmooths, the root not).
    bars = int(np.clip(np.sqrt(len(values)), 5, MAX_BARS))
    seen = np.log10(values) if axis.log else values
    heights, edges = np.histogram(seen, bins=bars)
    return Panel(axis, count, (Bars(10.0**edges if axis.log else edges, heights.astype(float)),))
