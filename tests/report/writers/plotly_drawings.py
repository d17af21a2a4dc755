"""Figures of a few marks, in the format of plotly."""

import base64
from typing import Any

import numpy as np

from rbstab.report.model.figure import (
    Axis,
    Figure,
    Panel,
)
from rbstab.report.writers.plotly_figures.renderer import plotly_data


def unpacked(array: dict[str, Any]) -> Any:
    """Return the numbers of an array in plotly's base64 form."""
    values = np.frombuffer(base64.b64decode(array["bdata"]), dtype=f"<{array['dtype']}")
    shape = array.get("shape")
    return values.reshape([int(n) for n in shape.split(",")]) if shape else values


PLAIN = Axis("quantity")


def drawing_of(*marks: Any, x: Axis = PLAIN, y: Axis = PLAIN) -> dict[str, Any]:
    return plotly_data(Figure("figure", "Figure", (Panel(x, y, marks),)))
