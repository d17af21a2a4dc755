"""The bounds on a reduced energy over boxes (`box_bounds`), with all that is added to its form.

Lines add theirs (`LinePart.over`), and so do guards of θ2 (`guards/bounds.py`).
"""

import numpy as np

from rbstab.analysis.proof.box_bounds import Enclosure
from rbstab.analysis.proof.boxes import ROUNDING_FACTOR, Boxes
from rbstab.analysis.proof.guards.bounds import guarded
from rbstab.analysis.proof.lines.intervals import total
from rbstab.analysis.proof.lines.over_boxes import at_centres
from rbstab.analysis.proof.trigonometric import TrigonometricForm


def enclosure(form: TrigonometricForm, boxes: Boxes) -> Enclosure:
    """Compute the bounds over boxes, about their centres."""
    if form.guard is None:
        return _bare_enclosure(form, boxes)
    return guarded(_bare_enclosure(form.unguarded, boxes), form.guard, boxes)


def _bare_enclosure(form: TrigonometricForm, boxes: Boxes) -> Enclosure:
    """Compute the bounds of a form without a barrier."""
    if form.lines:
        return _enclosure_with_lines(form, boxes)
    radius = boxes.radius
    value, gradient, hessian, third = form.rigorous(boxes.centre, 3)
    drift = np.einsum("kijl,ml->mkij", form.fourth_derivative_bound, radius)
    return Enclosure(
        radius,
        value.values,
        value.error,
        gradient.values,
        gradient.error,
        hessian.values,
        hessian.error,
        (np.abs(third.values) + third.error + drift) * ROUNDING_FACTOR,
    )


def _enclosure_with_lines(form: TrigonometricForm, boxes: Boxes) -> Enclosure:
    """Compute the bounds of a form with lines; terms of opposite signs are taken together."""
    radius, t = boxes.radius, form.basis(boxes.centre)
    parts = [at_centres(form, t, boxes), *(line.over(t, boxes) for line in form.lines)]
    value, gradient, hessian, third = (total(part) for part in zip(*parts, strict=True))
    return Enclosure(
        radius,
        value.middle,
        value.radius,
        gradient.middle,
        gradient.radius,
        hessian.middle,
        hessian.radius,
        third.size,
    )
