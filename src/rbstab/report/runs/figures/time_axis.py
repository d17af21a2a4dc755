"""The time axis of figures of runs: split in two where a fast transient needs room."""

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Figure, Line, Panel, Stack
from rbstab.report.model.split_time import FIRST_SHARE, SplitTime

MOST = 0.9
"""A transient is over when this share of all change of a quantity has happened."""

FAST = 0.1
"""A transient is fast if it is over within this share of the duration."""

MIN_SAMPLES = 20
"""The first part of a split axis has at least this many intervals between samples; with fewer, it
would show the straight lines between them."""

MAX_SPLIT = 0.25
"""A first part longer than this share of the duration has room enough on a linear axis."""

VISIBLE = 0.02
"""The change of a curve is visible if it is this share of the largest change in its panel."""

ROUND_FACTORS = (1.0, 2.0, 5.0, 10.0)
"""A split is at one of these, times a power of ten."""


class Transient(NamedTuple):
    """A fast transient: the label of its quantity, and when it is over, s."""

    label: str
    end: float


def with_room_for_transients(figure: Figure) -> Figure:
    """Split the time axis of a figure if one of its quantities has a fast transient.

    The change of a quantity is the sum of |y(k+1) - y(k)| over its samples. A transient is fast if
    `MOST` of it happens within `FAST` of the duration. The axis is split where the fastest
    transient is over, but not before `MIN_SAMPLES` intervals, at the next round number. Both parts
    are linear, so t = 0 stays on the axis. The caption says so. A figure without fast transients
    is returned as it is.
    """
    if not figure.shares_time:
        return figure
    curves = [(panel, x, y) for panel in figure.panels for x, y in _curves(panel)]
    times = np.concatenate([x for _, x, _ in curves]) if curves else np.zeros(0)
    if not len(times):
        return figure
    begin, end = float(times.min()), float(times.max())
    transients = [
        Transient(panel.y.label, over)
        for panel, x, y in curves
        if (over := end_of_change(x, y)) - begin <= FAST * (end - begin)
    ]
    if not transients:
        return figure
    resolved = max(_resolved(x) for _, x, _ in curves)
    # The fastest one decides: it needs the room most.
    at = begin + _round_up(max(resolved, min(one.end for one in transients)) - begin)
    if at - begin > MAX_SPLIT * (end - begin):
        return figure
    split = SplitTime(begin, at, end)
    panels = (replace(panel, x=replace(panel.x, split=split)) for panel in figure.panels)
    named = [transient for transient in transients if transient.end <= at]
    caption = f"{figure.caption} {_caption(split, named)}".strip()
    return replace(figure, panels=tuple(panels), caption=caption)


def end_of_change(times: Array, values: Array) -> float:
    """Return the time until which `MOST` of the change of a curve happens, s; inf for a constant.

    Args:
        times: Shape (n,), s, ascending.
        values: Shape (n,). Those that are not finite are left out.
    """
    shown = np.isfinite(values)
    times, values = times[shown], values[shown]
    if len(values) < 2 or not _span(values) > 0:
        return float("inf")
    # Scaled to at most 1, so that sums do not overflow.
    change = np.abs(np.diff(values / np.abs(values).max())).cumsum()
    return float(times[1:][np.searchsorted(change, MOST * change[-1])])


def _curves(panel: Panel) -> Iterable[tuple[Array, Array]]:
    """Yield the curves of a panel whose change is visible, with values as on its axis."""
    curves: list[tuple[Array, Array]] = []
    for mark in panel.marks:
        if isinstance(mark, Line):
            curves.append((mark.x, _on_axis(mark.y, panel.y)))
        elif isinstance(mark, Stack):
            curves += [(mark.x, part) for part in mark.parts.T]
    spans = [_span(values) for _, values in curves]
    visible = VISIBLE * max(spans, default=0.0)
    yield from (curve for curve, span in zip(curves, spans, strict=True) if span >= visible)


def _span(values: Array) -> float:
    shown = values[np.isfinite(values)]
    with np.errstate(over="ignore"):
        return float(np.ptp(shown)) if len(shown) else 0.0


def _on_axis(values: Array, axis: Axis) -> Array:
    values = np.asarray(values, dtype=float)
    if not axis.log:
        return values
    return np.log10(np.where(values > 0, values, np.nan))


def _resolved(times: Array) -> float:
    """Return the time after the first `MIN_SAMPLES` intervals, s; inf if there are fewer."""
    return float(times[MIN_SAMPLES]) if len(times) > MIN_SAMPLES else float("inf")


def _round_up(duration: float) -> float:
    if not np.isfinite(duration):
        return float("inf")
    power = 10.0 ** np.floor(np.log10(duration))
    # Round-off must not move a round number to the next one.
    return float(next(f * power for f in ROUND_FACTORS if f * power >= duration * (1 - 1e-9)))


def _caption(split: SplitTime, transients: list[Transient]) -> str:
    labels = list(dict.fromkeys(transient.label for transient in transients))
    named = ", ".join(labels[:3]) + (" and others" if len(labels) > 3 else "")
    at = f"{split.at - split.begin:g} s"
    return (
        f"The time axis has two scales, both linear: up to the dotted line at {at} it is "
        f"{_stretch(split):.2g} times as wide as after it. At least {MOST:.0%} of all change "
        f"happens before it (of {named})."
    )


def _stretch(split: SplitTime) -> float:
    """Return the width of a second in the first part over that in the second."""
    first, second = split.at - split.begin, split.end - split.at
    return FIRST_SHARE / first / ((1.0 - FIRST_SHARE) / second)
