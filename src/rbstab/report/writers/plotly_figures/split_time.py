"""Split time axes in plotly: each part is an axis of its own, and both have one vertical axis."""

from dataclasses import replace
from typing import Any

import numpy as np

from rbstab.report.model.figure import Figure, Level, Line, Mark, Panel, Points, Stack
from rbstab.report.model.split_time import FIRST_SHARE, SplitTime
from rbstab.report.writers.plotly_figures.panel_grid import PanelGrid, axis_keys, axis_name

JSON = dict[str, Any]

GAP = 8
"""Space between the two parts, px."""

TICKS = 4
"""Largest number of ticks of a part."""


def parts_of(mark: Mark, panel: Panel, number: int, count: int) -> list[tuple[Mark, int]]:
    """Return the parts of a mark, each with the number of its horizontal axis.

    Args:
        mark: The mark.
        panel: Its panel.
        number: The number of the panel.
        count: The number of panels; count + k is the number of the second axis of panel k.
    """
    split = panel.x.split
    if split is None:
        return [(mark, number)]
    first, second = _halves(mark, split)
    parts = [(first, number), (second, count + number)]
    return [(part, axis) for part, axis in parts if part is not None]


def split_axes(layout: JSON, figure: Figure, grid: PanelGrid) -> JSON:
    """Return a layout in which each split time axis is two axes, with a line between them."""
    count = len(figure.panels)
    keys = axis_keys(2 * count)[::2]
    axes, shapes, added = {}, [], []
    for number, panel in enumerate(figure.panels):
        split = panel.x.split
        if split is None:
            continue
        whole, after = layout[keys[number]], keys[count + number]
        begin, end = whole["domain"]
        middle = begin + FIRST_SHARE * (end - begin)
        half_gap = 0.5 * GAP / grid.width
        common = {"nticks": TICKS, "zeroline": False}
        axes[keys[number]] = whole | common | {"domain": [begin, middle - half_gap]}
        axes[keys[number]] |= {"range": [split.begin, split.at], "title": {"text": ""}}
        second = whole | common | {"domain": [middle + half_gap, end]}
        second |= {"range": [split.at, split.end], "matches": axis_name("x", count)}
        if number == 0:
            del second["matches"]
        axes[after] = second
        added.append(after)
        shapes.append(_border(axis_name("x", count + number), axis_name("y", number)))
    meta = layout["meta"] | {"axes": [*layout["meta"]["axes"], *added]}
    return layout | axes | {"meta": meta, "shapes": [*layout["shapes"], *shapes]}


def _halves(mark: Mark, split: SplitTime) -> tuple[Mark | None, Mark | None]:
    """Return the part of a mark on each part of the axis; None if it has none there."""
    if isinstance(mark, Level):
        if not mark.vertical:
            return mark, mark
        return (mark, None) if mark.value <= split.at else (None, mark)
    if isinstance(mark, Points):
        return _some(mark, mark.x <= split.at), _some(mark, mark.x > split.at)
    if isinstance(mark, Line | Stack):
        # Both parts have the points on both sides of the border, so that no segment is missing.
        first = np.searchsorted(mark.x, split.at, side="left") + 1
        last = max(np.searchsorted(mark.x, split.at, side="right") - 1, 0)
        return _cut(mark, slice(0, first)), _cut(mark, slice(last, None))
    raise TypeError(f"a mark of type {type(mark).__name__} cannot be drawn over a split time axis")


def _some(points: Points, chosen: Any) -> Points | None:
    if not chosen.any():
        return None
    texts = tuple(text for text, own in zip(points.texts, chosen, strict=False) if own)
    return replace(points, x=points.x[chosen], y=points.y[chosen], texts=texts)


def _cut(curve: Line | Stack, part: slice) -> Mark:
    if isinstance(curve, Line):
        return replace(curve, x=curve.x[part], y=curve.y[part])
    return replace(curve, x=curve.x[part], parts=curve.parts[part])


def _border(x: str, y: str) -> JSON:
    """Return a line at the left end of the second part of an axis."""
    line = {"color": "#7F7F7F", "width": 1, "dash": "dot"}
    ends = {"x0": 0, "x1": 0, "y0": 0, "y1": 1}
    return {"type": "line", "xref": f"{x} domain", "yref": f"{y} domain", "line": line} | ends
