"""The small pictures on the cards of runs: how v decays."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rbstab.experiment.summary import lyapunov_function_of
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Sketch
from rbstab.report.model.words import number
from rbstab.report.reading.sources import Run

LOWEST = 1e-8
"""v / v(0) below which a decay is not drawn: there round-off would fill the picture."""


def decay_sketches(runs: Sequence[Run]) -> list[Sketch | None]:
    """Return v(t)/v(0) of each run, with a dot from which on it is at rest.

    All have the same scales, so that they can be compared: logarithmic in v. If inputs supply power
    to a run, v need not decay, and v(0) may be zero: then each v is divided by its largest value,
    on a linear scale. There is None for a run that starts at rest, or whose v is never above zero,
    or not at the start, or that has fewer than two samples.
    """
    linear = any(run.is_driven for run in runs)
    decays = [_decay_of(run, by_largest=linear) for run in runs]
    drawn = [decay for decay in decays if decay is not None]
    if not drawn:
        return [None] * len(runs)
    end = max(float(decay.time[-1]) for decay in drawn)
    ratios = np.concatenate([decay.ratio for decay in drawn])
    high = max(float(np.nanmax(ratios)), 1.0)
    low = 0.0 if linear else float(np.nanmin(np.maximum(ratios, LOWEST)))
    settled = " Dot: at rest from there on." if any(decay.settled for decay in drawn) else ""
    shown = "v(t) over its largest value" if linear else "v(t)/v(0), logarithmic"
    below = " Not drawn: values at or below zero." if any(d.has_gaps for d in drawn) else ""
    caption = f"{shown}, over time.{settled}{below}"
    # Two digits, as 1.6e-6: the picture has little room beside it.
    y_ends = f"{low:.2g}".replace("e-0", "e-"), number(high)
    x_ends = ("0 s", f"{number(end)} s")

    def heights(ratio: Array) -> Array:
        if linear:
            return ratio / high
        with np.errstate(all="ignore"):
            span = math.log(high / low) or 1.0
            drawn = np.where(_is_inside(~(ratio >= LOWEST)), np.nan, np.maximum(ratio, LOWEST))
            return np.log(drawn / low) / span

    def sketch(decay: _Decay | None) -> Sketch | None:
        if decay is None:
            return None
        y = heights(decay.ratio)
        dot = np.array([decay.settled]) if decay.settled else np.zeros(0)
        dots = np.interp(dot, decay.time, y)
        curve = np.column_stack([decay.time / end, y])
        marks = np.column_stack([dot / end, dots])
        return Sketch(caption, (("", curve),), marks, x_ends, y_ends)

    return [sketch(decay) for decay in decays]


def _is_inside(chosen: Array) -> Array:
    """Return which of the chosen samples have only chosen neighbours: all but the ends of gaps."""
    padded = np.pad(chosen, 1, constant_values=True)
    inside: Array = padded[:-2] & chosen & padded[2:]
    return inside


class _Decay(NamedTuple):
    """v / v(0) of a run, or v over its largest value; NaN where v is not above zero.

    time counts from the start, s. settled is the time from which on the run is at rest, 0 if none.
    has_gaps tells whether v is at or below zero somewhere.
    """

    time: Array
    ratio: Array
    settled: float
    has_gaps: bool


def _decay_of(run: Run, *, by_largest: bool) -> _Decay | None:
    time = np.asarray(run.result["time"], dtype=float)
    v = np.asarray(lyapunov_function_of(run.result), dtype=float)
    unit = np.max(v, where=np.isfinite(v), initial=0.0) if by_largest else v[:1].sum()
    has_decay = run.settling_time != 0.0 and np.isfinite(unit) and unit > 0
    if len(time) < 2 or not (has_decay and time[-1] > time[0]):
        return None
    with np.errstate(all="ignore"):
        ratio = v / unit
    has_gaps = bool(np.any(ratio <= 0)) and not by_largest
    ratio = np.where(np.isfinite(ratio) & (ratio > 0), ratio, np.nan)
    settled = 0.0 if math.isnan(run.settling_time) else run.settling_time - float(time[0])
    return _Decay(time - time[0], ratio, settled, has_gaps)
