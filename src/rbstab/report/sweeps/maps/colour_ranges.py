"""The colour ranges of maps: common to maps that are compared, and not stretched over nothing."""

from dataclasses import replace

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Cells
from rbstab.report.model.words import number

ONE_COLOUR = 0.01
"""Values that differ by less than this fraction of the largest one have one colour.

Gains, inertia and initial states of a real body are not known better than to about 1 %. Colours
for smaller differences would suggest a structure that decides nothing; the numbers are shown.
"""


def on_one_scale(maps: list[Cells]) -> list[Cells]:
    """Return the maps of one quantity with a common colour scale."""
    if maps[0].scale.categories or maps[0].span is not None:
        return maps
    ends = _ends(_values(maps))
    if ends is None:
        return maps
    if has_one_colour(maps):
        # The middle of the scale for all of them.
        middle = 0.5 * (ends[0] + ends[1])
        ends = (min(0.5 * middle, 1.5 * middle), max(0.5 * middle, 1.5 * middle))
    return [replace(cells, span=ends) for cells in maps]


def has_one_colour(maps: list[Cells]) -> bool:
    """Return whether the values of maps of one quantity are too close to need more than a colour.

    A share and a map of words keep their scale.
    """
    given = maps[0].scale.categories or maps[0].span is not None
    return not given and is_narrow(_values(maps), maps[0].scale)


def one_colour_note(maps: list[Cells]) -> str:
    """Return a sentence on maps with one colour; "" for others."""
    if not has_one_colour(maps):
        return ""
    return f"One colour for {narrow_note(_values(maps), maps[0].scale)}"


def is_narrow(values: Array, axis: Axis) -> bool:
    """Return whether finite values on an axis differ by too little to be worth a picture."""
    ends = _ends(values)
    if axis.log or ends is None:
        return False
    return ends[1] - ends[0] < ONE_COLOUR * max(abs(ends[0]), abs(ends[1]))


def narrow_note(values: Array, axis: Axis) -> str:
    """Return the end of a sentence on such values: their name, range, and the rule."""
    low, high = _ends(values) or (float("nan"), float("nan"))
    unit = "" if axis.unit in ("", "1") else f" {axis.unit}"
    return (
        f"{axis.label}: all values are from {number(low)} to {number(high)}{unit}, which is less "
        f"than {ONE_COLOUR:.0%} apart."
    )


def _values(maps: list[Cells]) -> Array:
    return np.concatenate([np.asarray(cells.values, dtype=float).ravel() for cells in maps])


def _ends(values: Array) -> tuple[float, float] | None:
    """Return the smallest and the largest finite value; None without values."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if len(finite) else None
