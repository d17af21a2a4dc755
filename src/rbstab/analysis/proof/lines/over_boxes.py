"""A form and its derivatives at the centres of boxes and over them, as intervals."""

from typing import TYPE_CHECKING

import numpy as np

from rbstab.analysis.proof.boxes import ROUNDING_FACTOR, Boxes
from rbstab.analysis.proof.lines.intervals import Intervals, known
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.analysis.proof.trigonometric import TrigonometricForm


def at_centres(form: "TrigonometricForm", t: Array, boxes: Boxes) -> list[Intervals]:
    """Return a form without its lines, and its derivatives; those of order 3 over the boxes."""
    found = [known(one) for one in form.derivatives(t, boxes.centre, 3)]
    drift = np.einsum("kijl,ml->mkij", form.fourth_derivative_bound, boxes.radius)
    found[3] = Intervals(found[3].middle, (found[3].radius + drift) * ROUNDING_FACTOR)
    return found


def over_boxes(found: list[Intervals], radius: Array) -> list[Intervals]:
    """Return a function and its derivatives over boxes, by the mean value theorem.

    Args:
        found: Those of order 0 to 2 at the centres, and those of order 3 over the boxes.
        radius: The radii of the boxes, shape (m, 3).
    """
    over = [found[3]]
    for order in (2, 1, 0):
        reach = radius.reshape(-1, *[1] * order, 3)
        spread = (over[0].size * reach).sum(axis=-1)
        part = found[order]
        over.insert(0, Intervals(part.middle, (part.radius + spread) * ROUNDING_FACTOR))
    return over
