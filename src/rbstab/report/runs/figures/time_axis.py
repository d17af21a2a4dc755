"""The time axis of figures of runs: split in two where a fast transient needs room.

Figures that are seen together have one axis.
"""

from collections.abc import Iterable, Sequence
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


def with_room_for_transients(figures: Sequence[Figure]) -> list[Figure]:
    """Split the time axes of figures that are seen together if a quantity has a fast transient.

    The change of a quantity is the sum of |y(k+1) - y(k)| over its samples. A transient is fast if
    `MOST` of it happens within `FAST` of the duration of all figures; so a run that ends early has
    room too. All axes are split where the fastest transient is over, but not before `MIN_SAMPLES`
    intervals, at the next round number: a curve then has the same shape in all figures. Both parts
    are linear, so t = 0 stays on the axis. The captions say so. Errors do not decide, but have the
    same axis. Without fast transients the figures are returned as they are.

    Args:
        figures: The figures of one run, or those that overlay several.
    """
    over_time = [figure for figure in figures if figure.shares_time]
    found = [_transients(figure) for figure in over_time if not _shows_errors(figure)]
    curves = [curve for figure in over_time for _, curve in _curves_of(figure)]
    split = _common_split([one for fast in found for one in fast], curves, *_ends(over_time))
    if split is None:
        return list(figures)
    return [_split(figure, split) if figure.shares_time else figure for figure in figures]


def _transients(figure: Figure) -> list[Transient]:
    """Return when each curve of a figure has changed."""
    return [Transient(label, end_of_change(*curve)) for label, curve in _curves_of(figure)]


def _curves_of(figure: Figure) -> Iterable[tuple[str, tuple[Array, Array]]]:
    """Yield the label and the curve of each visible curve of a figure."""
    return ((panel.y.label, curve) for panel in figure.panels for curve in _curves(panel))


def _shows_errors(figure: Figure) -> bool:
    """Whether a figure shows only integration errors, whose jumps say nothing on the motion."""
    return all("residual" in panel.y.label for panel in figure.panels)


def _ends(figures: Sequence[Figure]) -> tuple[float, float]:
    """Return the first and the last time of the curves of figures, s."""
    times = [x for figure in figures for _, (x, _) in _curves_of(figure) if len(x)]
    if not times:
        return 0.0, 0.0
    return min(float(x.min()) for x in times), max(float(x.max()) for x in times)


def _common_split(
    transients: Sequence[Transient],
    curves: Sequence[tuple[Array, Array]],
    begin: float,
    end: float,
) -> SplitTime | None:
    """Return the split of all time axes; None if no transient is fast, or too few samples."""
    fast = [one.end for one in transients if one.end - begin <= FAST * (end - begin)]
    if not fast:
        return None
    resolved = max(_resolved(x) for x, _ in curves)
    # The fastest one decides: it needs the room most.
    at = begin + _round_up(max(resolved, min(fast)) - begin)
    return SplitTime(begin, at, end) if at - begin <= MAX_SPLIT * (end - begin) else None


def _split(figure: Figure, split: SplitTime) -> Figure:
    """Return a figure with a split time axis, and a caption that says so."""
    panels = (replace(panel, x=replace(panel.x, split=split)) for panel in figure.panels)
    named = [one for one in _transients(figure) if one.end <= split.at]
    own = [] if _shows_errors(figure) else named
    caption = f"{figure.caption} {_caption(split, own)}".strip()
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
    """Return the time after the first `MIN_SAMPLES` intervals, s; the last time if there are fewer.

    A run that ends early has few samples, and needs no room after its end.
    """
    return float(times[min(MIN_SAMPLES, len(times) - 1)]) if len(times) else 0.0


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
        f"{_stretch(split):.2g} times as wide as after it"
        + (
            f". At least {MOST:.0%} of all change happens before it (of {named})."
            if labels
            else ", as in the figures beside this one."
        )
    )


def _stretch(split: SplitTime) -> float:
    """Return the width of a second in the first part over that in the second."""
    first, second = split.at - split.begin, split.end - split.at
    return FIRST_SHARE / first / ((1.0 - FIRST_SHARE) / second)
