"""What a page needs of a figure beside its specification: legend, axes, and the cells of maps."""

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbstab.report.model.figure import Axis, Cells, Figure, Panel
from rbstab.report.writers.vega.cells import edges_of
from rbstab.report.writers.vega.legend import legend_of, legend_views
from rbstab.report.writers.vega.marks import JSON
from rbstab.report.writers.vega.specification import INDEPENDENT_SCALES, specification

WIDE = 800
"""The width of the specification in pixels; the page changes it."""


def page_data(figure: Figure) -> JSON:
    """Return a figure in the form that `figures.js` reads."""
    spec = specification(figure, width=WIDE, for_page=True)
    legend = legend_of(figure)
    arrays: list[JSON] = []
    return {
        "spec": spec,
        "legend": legend,
        "names": legend_views(legend, WIDE),
        "own": INDEPENDENT_SCALES,
        "panels": [_panel_data(panel, arrays) for panel in figure.panels],
        "arrays": arrays,
        "columns": figure.columns,
        "shared": figure.shared,
        "time": figure.shares_time,
        "command": figure.command,
    }


def _panel_data(panel: Panel, arrays: list[JSON]) -> JSON:
    maps = [mark for mark in panel.marks if isinstance(mark, Cells)]
    axes = {"x": _axis_data(panel.x), "y": _axis_data(panel.y)}
    return (
        {"title": panel.title, "square": panel.square}
        | axes
        | ({"map": _map_data(maps[0], panel, arrays)} if maps else {})
    )


def _axis_data(axis: Axis) -> JSON:
    unit = "" if axis.unit == "1" else axis.unit
    categories = list(axis.categories)
    return {
        "label": axis.label,
        "unit": unit,
        "text": axis.text,
        "log": axis.log,
        "categories": categories,
    }


def _map_data(cells: Cells, panel: Panel, arrays: list[JSON]) -> JSON:
    """Return a map; its arrays are numbers of `arrays`, where those of several maps stand once."""

    def number(array: NDArray[Any]) -> int:
        packed = packed_array(array)
        if packed not in arrays:
            arrays.append(packed)
        return arrays.index(packed)

    data: JSON = {
        "x": cells.x.tolist(),
        "y": cells.y.tolist(),
        "edges": [edges_of(cells.x, panel.x).tolist(), edges_of(cells.y, panel.y).tolist()],
        "values": number(cells.values),
        "scale": _axis_data(cells.scale),
    }
    if cells.members is None:
        return data
    members = cells.members
    return data | {
        "counts": number(members.counts),
        "shown": number(members.shown),
        "role": members.role,
        "gaps": number(members.gaps),
        "reasons": list(members.reasons),
    }


def packed_array(array: NDArray[Any]) -> JSON:
    """Return numbers as the page reads them: their type and their bytes in base64."""
    kind = "i4" if array.dtype.kind in "iu" else "f4"
    data = np.ascontiguousarray(array).astype(f"<{kind}").tobytes()
    return {"dtype": kind, "bdata": base64.b64encode(data).decode()}
