"""The ends of the axes of a figure."""

import numpy as np

from rbstab.report.model.figure import Axis, Cells, Figure
from rbstab.report.writers.vega.marks import JSON

PADDING = 0.04
"""Room around the data, as a share of the axis."""

Domain = dict[str, tuple[float, float]]
"""The ends of the axes x and y of a panel."""


def domains_of(figure: Figure, layers: list[list[JSON]]) -> list[Domain]:
    """Return the ends of both axes of each panel, which has these layers."""
    domains: list[Domain] = []
    for panel, panel_layers in zip(figure.panels, layers, strict=True):
        is_map = any(isinstance(mark, Cells) for mark in panel.marks)
        # Nothing is left free along the time.
        padding = {"x": figure.shares_time or is_map, "y": is_map}
        domains.append(
            {
                side: _ends(
                    getattr(panel, side), _values(panel_layers, side), 0.0 if tight else PADDING
                )
                for side, tight in padding.items()
            }
        )
    for side in {*figure.shared} | ({"x"} if figure.shares_time else set()):
        ends = np.array([domain[side] for domain in domains])
        for domain in domains:
            domain[side] = float(ends.min()), float(ends.max())
    return domains


def _values(layers: list[JSON], side: str) -> list[float]:
    """Return the numbers that layers show along an axis."""
    return [
        row[place["field"]]
        for layer in layers
        for channel, place in layer["encoding"].items()
        if channel in (side, f"{side}2")
        for row in layer["data"]["values"]
        if row[place["field"]] is not None
    ]


def _ends(axis: Axis, values: list[float], padding: float) -> tuple[float, float]:
    if axis.ends is not None:
        return axis.ends
    if axis.categories:
        return -0.5, len(axis.categories) - 0.5
    if not values:
        return (0.1, 1.0) if axis.log else (0.0, 1.0)
    ends = np.array([min(values), max(values)])
    low, high = np.log10(ends) if axis.log else ends
    beside = padding * (high - low)
    if low == high:
        beside = 0.5 if axis.log else max(abs(low) / 2, 0.5)
    low, high = float(low - beside), float(high + beside)
    # A power of ten beyond the largest double is no end of an axis.
    return (10.0**low, 10.0 ** min(high, 308.0)) if axis.log else (low, high)
