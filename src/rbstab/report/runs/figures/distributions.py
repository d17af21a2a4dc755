"""Histograms of the outcomes of many runs."""

from collections.abc import Sequence

import numpy as np

from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Bars, Figure, Panel
from rbstab.report.runs.facts import FACTS, RunFacts

NUMBERS = {
    "at rest from": False,
    "peak |E|": False,
    "peak |θ2|": False,
    f"|r|/{ENERGY_SCALE}": True,
}
"""The numbers whose distributions are drawn, and whether their axes are logarithmic."""

MAX_BARS = 40


def distribution_figure(facts: Sequence[RunFacts]) -> Figure:
    """Return histograms of settling time, peak |E|, peak |θ2| and the relative |r|.

    A quantity that no run has a value of is left out.
    """
    outcomes = {
        Axis(FACTS[name].head.text, log=log): np.array([FACTS[name].value(f) for f in facts])
        for name, log in NUMBERS.items()
    }
    drawn = {axis: _drawable(values, axis) for axis, values in outcomes.items()}
    panels = [_histogram(values, axis) for axis, values in drawn.items() if len(values)]
    missing = {a.label: len(facts) - len(v) for a, v in drawn.items() if len(v) < len(facts)}
    caption = ""
    if missing:
        named = "; ".join(f"{label}: {count}" for label, count in missing.items())
        caption = f"Number of runs without a value to draw: {named}."
    title = f"Outcomes of {len(facts)} runs"
    return Figure("runs-distributions", title, tuple(panels), 2, caption=caption)


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
