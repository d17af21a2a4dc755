"""The legend of a figure: its entries, and the view that shows them in a file."""

from collections.abc import Iterable
from typing import Any

import numpy as np

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
from rbstab.report.model.palette import CASED, GAP, area_colour, colour
from rbstab.report.writers.vega.cells import tints_of
from rbstab.report.writers.vega.marks import DASHES, JSON, LEVEL, SYMBOLS, entry_of

LETTER = 6.5
"""Pixels for a letter."""

SWATCH = 38
"""Pixels for what is beside the letters of an entry."""


def legend_of(figure: Figure) -> list[JSON]:
    """Return the entries of the legend: `of`, `label`, `colour`, `kind`, `dash` and `symbol`.

    The kind is line, area or point; or it is what a map shows and what cannot be hidden: word, or
    gap for cells without a value. The same colour may be another word in another map: where maps
    differ in their words, `of` says of which map an entry is; elsewhere it is "". What many curves
    share is named last.
    """
    marks = [mark for panel in figure.panels for mark in panel.marks]
    scales = {mark.scale for mark in marks if isinstance(mark, Cells) and mark.scale.categories}
    entries: dict[tuple[str, str], JSON] = {}
    for mark in sorted(marks, key=lambda mark: bool(getattr(mark, "group", ""))):
        map_label = mark.scale.label if isinstance(mark, Cells) and len(scales) > 1 else ""
        for entry in _entries(mark):
            of = map_label if entry["kind"] == "word" else ""
            entries.setdefault((of, entry["label"]), entry | {"of": of})
    return [entry for entry in entries.values() if entry["label"]]


def _entries(mark: Mark) -> Iterable[JSON]:
    """Yield the entries of a mark; those without a label are not shown."""
    match mark:
        case Line():
            tint = CASED if mark.cased else colour(mark.colour)
            yield _entry(entry_of(mark), tint, "line", dash=mark.dash)
        case Points():
            tint = colour(mark.colour if mark.key is None else mark.key)
            yield _entry(entry_of(mark), tint, "point", symbol=mark.symbol % len(SYMBOLS))
        case Level():
            yield _entry(mark.label, LEVEL["color"], "line", dash=1)
        case Band():
            yield _entry(mark.label, colour(mark.colour), "area")
        case Stack():
            yield from (
                _entry(label, area_colour(k), "area") for k, label in enumerate(mark.labels)
            )
        case Shares():
            for label, number in zip(mark.labels, mark.colours, strict=True):
                yield _entry(label, colour(number), "area")
        case Cells():
            for label, tint in zip(mark.scale.categories, tints_of(mark), strict=False):
                yield _entry(label, tint, "word")
            if reasons := reasons_of(mark):
                yield _entry(f"no value: {', '.join(reasons)}", GAP, "gap")


def _entry(label: str, tint: str, kind: str, *, dash: int = 0, symbol: int = 0) -> JSON:
    pattern = DASHES[dash % len(DASHES)]
    return {"label": label, "colour": tint, "kind": kind, "dash": pattern, "symbol": symbol}


def reasons_of(cells: Cells) -> list[str]:
    """Return why cells of a map have no value: the reasons that occur."""
    if cells.members is None:
        return []
    occurring = set(np.unique(cells.members.gaps).tolist())
    return [reason for number, reason in enumerate(cells.members.reasons) if number in occurring]


def legend_views(entries: list[JSON], width: float) -> list[JSON]:
    """Return the legend of a file: views without anything else, one for each map of words."""
    groups = dict.fromkeys(entry["of"] for entry in entries)
    return [_view(of, [entry for entry in entries if entry["of"] == of], width) for of in groups]


def _view(of: str, entries: list[JSON], width: float) -> JSON:
    names = [entry["label"] for entry in entries]
    shapes = {"line": "stroke", "area": "square", "word": "square", "gap": "square"}
    filled = [
        entry["colour"] if entry["kind"] in ("area", "word") else "transparent" for entry in entries
    ]
    ranges: dict[str, list[Any]] = {
        "stroke": [entry["colour"] for entry in entries],
        "fill": filled,
        "strokeDash": [entry["dash"] for entry in entries],
        "shape": [shapes.get(entry["kind"], SYMBOLS[entry["symbol"]]) for entry in entries],
    }
    columns = max(1, int(width / (LETTER * max(map(len, names)) + SWATCH)))
    look = {
        "orient": "top",
        "columns": columns,
        "symbolStrokeWidth": 1.8,
        "symbolSize": 120,
        "offset": 4,
    }
    return {
        "width": width,
        "height": 1,
        "view": {"stroke": None},
        "data": {"values": [{"series": name} for name in names]},
        "mark": {"type": "point", "size": 0, "opacity": 1},
        "encoding": {
            channel: {
                "field": "series",
                "type": "nominal",
                "scale": {"domain": names, "range": values},
                "title": of or None,
                "legend": look,
            }
            for channel, values in ranges.items()
        },
    }
