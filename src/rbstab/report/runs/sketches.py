"""The small pictures on the cards of runs: how v decays."""

from collections.abc import Sequence

import numpy as np

from rbstab.experiment.answers.rounded import number
from rbstab.experiment.summary import lyapunov_function_of
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Sketch
from rbstab.report.reading.sources import Run

LOWEST = 1e-8
"""v / v(0) below which a decay is not drawn: there round-off would fill the picture."""


@np.errstate(all="ignore")
def decay_sketches(runs: Sequence[Run]) -> list[Sketch | None]:
    """Return v(t)/v(0) of each run, with a dot from which on it is at rest.

    All have the same scales, so that they can be compared: logarithmic in v. If elements supply
    power to a run, v need not decay, and v(0) may be zero: then each v is divided by its largest
    value, on a linear scale. There is None for a run that starts at rest, or whose v is never above
    zero, or not at the start, or that has fewer than two samples.
    """
    linear = any(run.is_driven for run in runs)
    ratios = [_ratio(run, by_largest=linear) for run in runs]
    drawn = [(run, y) for run, y in zip(runs, ratios, strict=True) if y is not None]
    if not drawn:
        return [None] * len(runs)
    end = max(float(np.ptp(run.result["time"])) for run, _ in drawn)
    high = max(1.0, *(float(np.nanmax(y)) for _, y in drawn))
    low = 0.0 if linear else min(0.5 * high, *(float(np.nanmin(y)) for _, y in drawn))
    shown = "v(t) over its largest value" if linear else "v(t)/v(0), logarithmic"
    at_rest = any(run.settling_time > 0 for run, _ in drawn)
    caption = f"{shown}, over time.{' Dot: at rest from there on.' if at_rest else ''}"
    # Two digits, as 1.6e-6: the picture has little room beside it.
    y_ends = f"{low:.2g}".replace("e-0", "e-"), number(high)

    def sketch(run: Run, ratio: Array | None) -> Sketch | None:
        if ratio is None:
            return None
        t = run.result["time"] - run.result["time"][0]
        y = ratio / high if linear else np.log(ratio / low) / np.log(high / low)
        rest = run.settling_time - run.result["time"][0]
        dots = np.array([rest] if rest > 0 else [])
        marks = np.column_stack([dots / end, np.interp(dots, t, y)])
        curve = np.column_stack([t / end, y])
        return Sketch(caption, (("", curve),), marks, ("0 s", f"{number(end)} s"), y_ends)

    return [sketch(run, ratio) for run, ratio in zip(runs, ratios, strict=True)]


def _ratio(run: Run, *, by_largest: bool) -> Array | None:
    """Return v over v(0) or its largest value; NaN where it is not drawn, None for no decay."""
    v = lyapunov_function_of(run.result)
    unit = v.max(where=np.isfinite(v), initial=0.0) if by_largest else v[0]
    if run.settling_time == 0.0 or not 0.0 < unit < np.inf or not np.ptp(run.result["time"]) > 0:
        return None
    ratio = v / unit
    # What is not above `LOWEST` is not drawn on a logarithmic scale.
    return np.where(np.isfinite(ratio) & (ratio > (0.0 if by_largest else LOWEST)), ratio, np.nan)
