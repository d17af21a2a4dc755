"""Figures of maps that are compared."""

from typing import Any

import numpy as np

from rbstab.report.model.figure import Axis, Cells, Figure, Panel


def compared_maps(count: int, **options: Any) -> Figure:
    """Return a figure of maps of one value each, three in a row."""
    middles = np.arange(3.0)
    axes = Axis("across", "m"), Axis("up", "s")
    panels = tuple(
        Panel(*axes, (Cells(middles, middles, np.full((3, 3), n), Axis("z"), (0.0, 9.0)),), str(n))
        for n in range(count)
    )
    return Figure("f", "F", panels, 3, **options)
