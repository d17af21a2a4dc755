"""What a page needs of a figure beside its specification: legend, axes, and the cells of maps."""

import base64

import numpy as np
from numpy.typing import NDArray

from rbstab.report.model.figure import Axis, Cells, Figure, Panel
from rbstab.report.writers.vega.cells import edges_of, levels_of, packed, span_of, tints_of
from rbstab.report.writers.vega.legend import legend_of
from rbstab.report.writers.vega.marks import JSON
from rbstab.report.writers.vega.specification import specification

WIDE = 800
"""The width of the specification in pixels; the page changes it."""


def page_data(figure: Figure) -> JSON:
    """Return a figure in the form that `figures.js` reads."""
    spec = specification(figure, width=WIDE, for_page=True)
    heights = [panel["height"] for panel in spec["concat"]]
    return {
        "spec": spec,
        "legend": legend_of(figure),
        "panels": [_panel_data(panel) for panel in figure.panels],
        "columns": figure.columns,
        "small": figure.small,
        "shared": figure.shared,
        "square": [panel.square or panel.equal for panel in figure.panels],
        "bars": any(
            isinstance(m, Cells) and not m.scale.categories for p in figure.panels for m in p.marks
        ),
        "time": figure.shares_time,
        "command": figure.command,
        "rows": -(-len(figure.panels) // spec["columns"]),
        "height": max(heights),
    }


def _panel_data(panel: Panel) -> JSON:
    maps = [mark for mark in panel.marks if isinstance(mark, Cells)]
    axes = {"title": panel.title, "x": _axis_data(panel.x), "y": _axis_data(panel.y)}
    return axes | ({"map": _map_data(maps[0], panel)} if maps else {})


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


def _map_data(cells: Cells, panel: Panel) -> JSON:
    data: JSON = {
        "x": cells.x.tolist(),
        "y": cells.y.tolist(),
        "edges": [edges_of(cells.x, panel.x).tolist(), edges_of(cells.y, panel.y).tolist()],
        "log": [panel.x.log, panel.y.log],
        "levels": packed(levels_of(cells)),
        "scale": _axis_data(cells.scale),
        "span": list(span_of(cells)),
        "tints": tints_of(cells),
    }
    if cells.members is None:
        return data
    members = cells.members
    return data | {
        "counts": packed_array(members.counts.astype(np.int32)),
        "shown": packed_array(members.shown.astype(np.int32)),
        "role": members.role,
        "reasons": list(members.reasons),
    }


def packed_array(array: NDArray[np.generic]) -> JSON:
    """Return numbers as the page reads them: their type and their bytes in base64."""
    kept = array.astype(np.float32) if array.dtype == np.float64 else array
    little = kept.astype(kept.dtype.newbyteorder("<"))
    data = base64.b64encode(np.ascontiguousarray(little).tobytes()).decode()
    return {"dtype": f"{kept.dtype.kind}{kept.dtype.itemsize}", "bdata": data}
