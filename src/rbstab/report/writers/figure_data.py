"""The data of a figure as CSV: a row for each point that is drawn."""

import csv
from collections.abc import Iterator
from io import StringIO
from typing import Any

import numpy as np

from rbstab.config.errors import printable
from rbstab.report.model.figure import (
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

HEADS = ("panel", "x_axis", "y_axis", "series", "x", "y", "low", "high", "value")
"""The columns. low and high are the ends of an interval or of a band, or of a bar along x; value is
the colour of a cell of a map."""


def csv_of(figure: Figure) -> str:
    """Return the data of a figure as CSV, with all digits and without thinning."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADS)
    for number, panel in enumerate(figure.panels, start=1):
        axes = panel.title or number, panel.x.text, panel.y.text
        head = tuple(printable(str(entry)) for entry in axes)
        for mark in panel.marks:
            for row in _rows(mark, panel):
                writer.writerow((*head, *row))
    return text.getvalue()


def _rows(mark: Mark, panel: Panel) -> Iterator[tuple[Any, ...]]:
    """Yield series, x, y, low, high and value of each point of a mark."""
    match mark:
        case Line() | Points():
            yield from _point_rows(mark, panel)
        case Stack():
            for label, part in zip(mark.labels, mark.parts.T, strict=True):
                yield from ((label, *point, "", "", "") for point in _columns(mark.x, part))
        case Bars():
            middle = 0.5 * (mark.edges[:-1] + mark.edges[1:])
            columns = _columns(middle, mark.heights, mark.edges[:-1], mark.edges[1:])
            yield from ((mark.label, *point, "") for point in columns)
        case Intervals():
            for x, *others in _columns(mark.x, mark.y, mark.low, mark.high):
                yield (mark.label, _named(x, panel.x.categories), *others, "")
        case Band():
            for x, *ends in _columns(mark.x, mark.low, mark.high):
                yield (mark.label, x, "", *ends, "")
        case Cells():
            x, y = np.meshgrid(mark.x, mark.y)
            for *cell, value in _columns(x.ravel(), y.ravel(), mark.values.ravel()):
                yield (mark.scale.text, *cell, "", "", _named(value, mark.scale.categories))
        case Shares():
            yield from _share_rows(mark, panel)
        case Level():
            place = (mark.value, "") if mark.vertical else ("", mark.value)
            yield (mark.label, *place, "", "", "")


def _point_rows(mark: Line | Points, panel: Panel) -> Iterator[tuple[Any, ...]]:
    for x, y in _columns(mark.x, mark.y):
        place = _named(x, panel.x.categories), _named(y, panel.y.categories)
        yield (mark.label, *place, "", "", "")


def _share_rows(mark: Shares, panel: Panel) -> Iterator[tuple[Any, ...]]:
    """Yield a row for each part of each bar: its share is x, and its count the value."""
    for label, shares, counts in zip(mark.labels, mark.values.T, mark.counts.T, strict=True):
        for y, (x, count) in enumerate(_columns(shares, counts)):
            yield (label, x, _named(y, panel.y.categories), "", "", int(count))


def _columns(*arrays: Any) -> Iterator[tuple[Any, ...]]:
    """Yield the entries of arrays together, as numbers that are read back with the same bits."""
    return zip(*(np.asarray(array, dtype=float).tolist() for array in arrays), strict=True)


def _named(value: float, categories: tuple[str, ...]) -> float | str:
    return categories[int(value)] if value in range(len(categories)) else value
