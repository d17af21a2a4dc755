"""Histograms of the outcomes of many runs."""

from collections.abc import Sequence

import numpy as np

from rbstab.analysis.lyapunov import ENERGY_SCALE, ENERGY_SCALE_NOTE
from rbstab.experiment.summary import lyapunov_function_of
from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Bars, Figure, Panel
from rbstab.report.reading.sources import Run

MAX_BARS = 40


def distribution_figure(runs: Sequence[Run]) -> Figure:
    """Return histograms of settling time, peak |E|, v(end)/v(0) and the relative |r|.

    A quantity that no run has a value of is left out, and the caption says so.
    """
    summaries = [run.summary for run in runs]
    with np.errstate(all="ignore"):
        # Not what a result may store in place of v: v - ε does not end at zero.
        values_of_v = [lyapunov_function_of(run.result) for run in runs]
        # A run that starts at rest does not decay.
        decay = [
            v[-1] / v[0] if run.settling_time != 0.0 else np.nan
            for run, v in zip(runs, values_of_v, strict=True)
        ]
    outcomes = (
        (Axis("settling time", "s"), [run.settling_time for run in runs]),
        (Axis("peak |E|", "m"), [s.peak_distance for s in summaries]),
        (Axis("v(end) / v(0)", log=True), decay),
        (Axis(f"largest |r| / {ENERGY_SCALE}", log=True), [s.relative_residual for s in summaries]),
    )
    panels, missing = [], []
    for axis, values in outcomes:
        shown = _drawable(np.array(values, dtype=float), axis)
        if len(shown):
            panels.append(_histogram(shown, axis))
        if len(shown) < len(runs):
            missing.append(f"{axis.label}: {len(runs) - len(shown)}")
    caption = f"A run has settled when v stays below v(0)/1000. {ENERGY_SCALE_NOTE}"
    if missing:
        caption += f" Number of runs without a value to draw: {'; '.join(missing)}."
    return Figure(
        "runs-distributions", f"Outcomes of {len(runs)} runs", tuple(panels), 2, caption=caption
    )


def _drawable(values: Array, axis: Axis) -> Array:
    values = values[np.isfinite(values)]
    return values[values > 0] if axis.log else values


def _histogram(values: Array, axis: Axis) -> Panel:
    # The square root rule.
    bars = int(np.clip(np.sqrt(len(values)), 5, MAX_BARS))
    scaled = np.log10(values) if axis.log else values
    heights, edges = np.histogram(scaled, bins=bars)
    bars_drawn = Bars(10.0**edges if axis.log else edges, heights.astype(float))
    return Panel(axis, Axis("runs", whole=True), (bars_drawn,))
