"""Panels with nothing to show: a figure leaves them out, and says so."""

from dataclasses import replace

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Bars, Figure, Level, Line, Panel, Points, Stack

ZERO, MISSING = "zero throughout", "no value that can be drawn"
"""Reasons why a panel is left out."""


def without_empty_panels(figure: Figure) -> Figure | str:
    """Return a figure without the panels that show nothing; a sentence if none is left.

    A panel shows nothing if all its values are zero, or cannot be drawn on its axes. The caption
    names the quantities that are left out.
    """
    reasons = [_reason(panel) for panel in figure.panels]
    shown = tuple(panel for panel, reason in zip(figure.panels, reasons, strict=True) if not reason)
    if len(shown) == len(figure.panels):
        return figure
    sentence = _sentence(figure.panels, shown, reasons)
    if not shown:
        return f"{figure.title}: there is no figure. {sentence}"
    return replace(figure, panels=shown, caption=f"{figure.caption} {sentence}".strip())


def _reason(panel: Panel) -> str:
    """Return why a panel shows nothing; "" if it shows something."""
    values = [part for mark in panel.marks for part in _values(mark)]
    every = np.concatenate([np.zeros(0), *values])
    if len(every) and not every.any():
        return ZERO
    return "" if _drawable(every, panel.y).any() else MISSING


def _values(mark: object) -> list[Array]:
    """Return the values of a mark; levels are no values."""
    match mark:
        case Line() | Points():
            return [np.asarray(mark.y, dtype=float)]
        case Stack():
            return [np.asarray(mark.parts, dtype=float).ravel()]
        case Bars():
            return [np.asarray(mark.heights, dtype=float)]
        case Level():
            return []
    raise TypeError(f"a figure of a run has no mark of type {type(mark).__name__}")


def _drawable(values: Array, axis: Axis) -> Array:
    with np.errstate(invalid="ignore"):
        return np.isfinite(values) & ((values > 0) | (not axis.log))


def _sentence(panels: tuple[Panel, ...], shown: tuple[Panel, ...], reasons: list[str]) -> str:
    """Return a sentence that names the quantities that are left out, each once."""
    drawn = {panel.y.label for panel in shown}
    left = {
        f"{panel.y.label}{' on a logarithmic axis' if panel.y.label in drawn else ''}": reason
        for panel, reason in zip(panels, reasons, strict=True)
        if reason
    }
    return f"Left out: {'; '.join(f'{label} ({reason})' for label, reason in left.items())}."
