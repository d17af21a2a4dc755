"""The data of a figure in columns: drawings have them in their rows, and CSV files as they are."""

import csv
from collections.abc import Iterator
from io import StringIO
from itertools import repeat
from typing import Any

import numpy as np

from rbstab.files.text import printable
from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import (
    Band,
    Cells,
    Figure,
    Level,
    Line,
    Mark,
    Points,
    Shares,
    Stack,
)

HEADS = ("panel", "x_axis", "y_axis", "series", "x", "y", "low", "high", "value")
"""The columns of a file: those of `series_of` come last."""

COLUMNS = HEADS[-5:]


def csv_of(figure: Figure) -> str:
    """Return the data of a figure as CSV, with all digits and without thinning."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADS)
    for number, panel in enumerate(figure.panels, start=1):
        axes = panel.title or number, panel.x.text, panel.y.text
        head = tuple(printable(str(entry)) for entry in axes)
        for mark in panel.marks:
            words = {"x": panel.x.categories, "y": panel.y.categories}
            if isinstance(mark, Cells):
                words["value"] = mark.scale.categories
            for series, columns in series_of(mark):
                # All but one may be without an end.
                entries = (_entries(columns.get(name), words.get(name, ())) for name in COLUMNS)
                writer.writerows((*head, series, *row) for row in zip(*entries, strict=False))
    return text.getvalue()


def _entries(values: Array | None, words: tuple[str, ...]) -> Any:
    """Return numbers that are read back with the same bits, or the categories at them."""
    if values is None:
        return repeat("")
    numbers = values.tolist()
    return [words[int(n)] if n in range(len(words)) else n for n in numbers] if words else numbers


def series_of(mark: Mark) -> Iterator[tuple[str, dict[str, Array]]]:
    """Yield the name of each series of a mark, and its columns.

    Columns are x and y; low and high, the ends of a band, of an area of a stack along y, or of a
    part of a bar along x; and value, the colour of a cell of a map or the count of a part.
    """
    match mark:
        case Line() | Points():
            yield mark.label, {"x": mark.x, "y": mark.y}
        case Band():
            yield mark.label, {"x": mark.x, "low": mark.low, "high": mark.high}
        case Stack():
            up, down = np.zeros(len(mark.x)), np.zeros(len(mark.x))
            for label, part in zip(mark.labels, mark.parts.T, strict=True):
                # What is negative is stacked downwards.
                low = np.where(part >= 0, up, down)
                with np.errstate(over="ignore"):  # what is infinite is not drawn
                    high = low + part
                up, down = np.where(part >= 0, high, up), np.where(part < 0, high, down)
                yield label, {"x": mark.x, "y": part, "low": low, "high": high}
        case Shares():
            ends, bars = mark.values.cumsum(axis=1), np.arange(len(mark.counts))
            for k, label in enumerate(mark.labels):
                share, end = mark.values[:, k], ends[:, k]
                columns = {"x": share, "y": bars, "low": end - share, "high": end}
                yield label, columns | {"value": mark.counts[:, k]}
        case Level():
            yield mark.label, {"x" if mark.vertical else "y": np.array([mark.value])}
        case Cells():
            x, y = np.meshgrid(mark.x, mark.y)
            columns = {"x": x.ravel(), "y": y.ravel(), "value": mark.values.ravel()}
            yield mark.scale.text, columns
