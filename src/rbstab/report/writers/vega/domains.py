"""The ends of the axes of a figure."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import (
    Axis,
    Band,
    Bars,
    Cells,
    Figure,
    Intervals,
    Level,
    Line,
    Mark,
    Panel,
    Points,
    Shares,
    Stack,
)
from rbstab.report.writers.vega.cells import edges_of
from rbstab.report.writers.vega.marks import LARGEST

PADDING = 0.04
"""Room around the data, as a share of the axis."""

Domain = dict[str, tuple[float, float]]
"""The ends of the axes x and y of a panel."""


def domains_of(figure: Figure) -> list[Domain]:
    """Return the ends of both axes of each panel."""
    domains = [_domain(panel, tight=figure.shares_time) for panel in figure.panels]
    for side in {*figure.shared} | ({"x"} if figure.shares_time else set()):
        ends = np.array([domain[side] for domain in domains])
        for domain in domains:
            domain[side] = float(ends.min()), float(ends.max())
    return domains


def _domain(panel: Panel, *, tight: bool) -> Domain:
    """Return the ends of the axes of a panel; tight: nothing is left free along x."""
    is_map = any(isinstance(mark, Cells) for mark in panel.marks)
    x = _ends_of(panel, panel.x, 0, 0.0 if tight or is_map else PADDING)
    return {"x": x, "y": _ends_of(panel, panel.y, 1, 0.0 if is_map else PADDING)}


def _ends_of(panel: Panel, axis: Axis, side: int, padding: float) -> tuple[float, float]:
    if axis.ends is not None:
        return axis.ends
    if axis.categories:
        return -0.5, len(axis.categories) - 0.5
    found = [np.ravel(array) for mark in panel.marks for array in _values(mark, panel)[side]]
    values = np.concatenate([np.zeros(0), *found])
    values = values[(np.abs(values) <= LARGEST) & ((values > 0) | (not axis.log))]
    if not len(values):
        return (0.1, 1.0) if axis.log else (0.0, 1.0)
    ends = np.array([values.min(), values.max()])
    low, high = np.log10(ends) if axis.log else ends
    beside = padding * (high - low)
    if low == high:
        beside = 0.5 if axis.log else max(abs(low) / 2, 0.5)
    low, high = float(low - beside), float(high + beside)
    # A power of ten beyond the largest double is no end of an axis.
    return (10.0**low, 10.0 ** min(high, 308.0)) if axis.log else (low, high)


def _values(mark: Mark, panel: Panel) -> tuple[list[Array], list[Array]]:
    """Return all that a mark has along x, and along y."""
    x: list[Array] = [mark.x] if not isinstance(mark, Bars | Level | Shares) else []
    y: list[Array] = []
    match mark:
        case Line() | Points():
            y = [mark.y]
        case Intervals():
            y = [mark.y, mark.low, mark.high]
        case Band():
            y = [mark.low, mark.high]
        case Stack():
            with np.errstate(over="ignore"):  # infinite ends are left out
                y = [half(mark.parts, 0.0).sum(axis=1) for half in (np.maximum, np.minimum)]
        case Bars():
            x, y = [mark.edges], [mark.heights, np.zeros(1)]
        case Cells():
            x, y = [edges_of(mark.x, panel.x)], [edges_of(mark.y, panel.y)]
        case Level():
            x, y = ([np.array([mark.value])], [])[:: 1 if mark.vertical else -1]
        case Shares():
            x = [np.array([0.0, 1.0])]
    return x, y
