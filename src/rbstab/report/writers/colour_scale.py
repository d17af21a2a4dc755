"""The colour scale and the edges of the cells of a map, for all libraries that draw it."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Cells
from rbstab.report.model.palette import DIVERGING

MIN_TICKS = 3
"""Smallest number of labels of a colour bar; between fewer, no value can be read."""

MAX_POWERS = 9
"""Largest number of powers of ten among the ticks."""


def scale_ends(cells: Cells) -> tuple[float, float]:
    """Return the values at both ends of the colour scale of a map of numbers; low < high.

    A single value gets the colour in the middle of the scale.
    """
    values = np.asarray(cells.values, dtype=float)
    shown = values[np.isfinite(values) & ((values > 0) | (not cells.scale.log))]
    low, high = (float(shown.min()), float(shown.max())) if len(shown) else (1.0, 10.0)
    low, high = cells.span or (low, high)
    if low < high:
        return low, high
    if cells.scale.log:
        return low / 2, 2 * low
    return low - 0.5 * (abs(low) or 1.0), low + 0.5 * (abs(low) or 1.0)


def diverges(cells: Cells) -> bool:
    """Return whether a map has values on both sides of the middle of its scale."""
    middle = cells.scale.middle
    if middle is None:
        return False
    values = np.asarray(cells.values, dtype=float)
    low, high = cells.span or (np.nanmin(values, initial=middle), np.nanmax(values, initial=middle))
    return bool(low < middle < high)


def diverging_colours(cells: Cells) -> list[tuple[float, str]]:
    """Return the colours of a map that diverges, with their places: 0 at the lower end, 1 above.

    The middle of the scale is white. Values as far below it as above have colours as strong; the
    side that reaches less far is cut off, so that the bar shows no values that do not occur.
    """
    middle = cells.scale.middle
    assert middle is not None
    ends = scale_ends(cells)
    measure = np.log if cells.scale.log else np.asarray
    low, centre, high = (float(measure(value)) for value in (ends[0], middle, ends[1]))
    reach = max(high - centre, centre - low)
    # Places of all colours on this scale; those beyond an end are replaced by the colour there.
    places = centre + reach * np.linspace(-1.0, 1.0, len(DIVERGING))
    inside = places[(places > low) & (places < high)]
    shown = np.array([low, *inside.tolist(), high])
    tones = np.array([[*bytes.fromhex(tone[1:])] for tone in DIVERGING], dtype=float)
    mixed = np.column_stack([np.interp(shown, places, tone) for tone in tones.T]).round()
    texts = [f"#{bytes(row).hex().upper()}" for row in mixed.astype(np.uint8)]
    return list(zip(((shown - low) / (high - low)).tolist(), texts, strict=True))


def bar_title(scale: Axis, *, titled: bool) -> str:
    """Return the title of a colour bar, with the word for a logarithmic one."""
    return ", ".join([scale.text] * titled + ["logarithmic"] * scale.log)


def scale_ticks(low: float, high: float, *, log: bool) -> dict[float, str]:
    """Return the ticks of a colour scale, at least `MIN_TICKS`, with their labels.

    Args:
        low: The value at the lower end.
        high: The value at the upper end, larger than low.
        log: Whether the scale is logarithmic. Ticks are then powers of ten, or these times 1, 2
            and 5, if there are enough of them.
    """
    if log:
        first, last = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
        for factors in ((1,), (1, 2, 5)):
            ticks = [f * 10.0**k for k in range(first, last + 1) for f in factors]
            inside = [tick for tick in ticks if low <= tick <= high]
            if len(inside) >= MIN_TICKS:
                return {tick: f"{tick:g}" for tick in inside[:: -(-len(inside) // MAX_POWERS)]}
    step = _step(low, high)
    digits = max(6, int(np.ceil(np.log10(max(abs(low), abs(high)) / step))) + 1)
    multiples = range(int(np.ceil(low / step)), int(np.floor(high / step)) + 1)
    # Round-off must not carry a tick beyond an end.
    return {min(max(n * step, low), high): f"{n * step:.{digits}g}" for n in multiples}


def cell_edges(centres: Array, axis: Axis) -> Array:
    """Return the edges of cells, halfway between their centres on the axis, shape (n + 1,)."""
    places = np.log10(centres) if axis.log else np.asarray(centres, dtype=float)
    steps = np.diff(places) if len(places) > 1 else np.ones(1)
    inner = places[:-1] + steps[: len(places) - 1] / 2
    edges = np.concatenate([[places[0] - steps[0] / 2], inner, [places[-1] + steps[-1] / 2]])
    return 10.0**edges if axis.log else edges


def gap_label(reason: str) -> str:
    """Return the legend entry of the cells that have no value for a reason."""
    return f"no value: {reason}"


def _step(low: float, high: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten with more than `MIN_TICKS` ticks."""
    power = int(np.floor(np.log10(high - low)))
    steps = [f * 10.0**k for k in (power, power - 1) for f in (5, 2, 1)]
    enough = (s for s in steps if np.floor(high / s) - np.ceil(low / s) + 1 > MIN_TICKS)
    return next(enough, steps[-1])
