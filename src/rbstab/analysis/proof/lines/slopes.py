"""A proved bound on the slope of the periodic part of an energy with lines, by branch and bound.

The bounds of single terms add up to far more than the slope: those of a spring nearly cancel.
"""

from dataclasses import replace

import numpy as np

from rbstab.analysis.proof.boxes import PI, RANGE_END, ROUNDING_FACTOR, Boxes, joined
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

BOX_LIMIT = 20_000
"""The number of boxes at which the search stops; the bound is then that of single terms."""

FACTOR = 1.3
"""The bound is this times the largest slope that was seen. A closer one would take longer, and its
check too."""


@np.errstate(all="ignore")  # comparisons with NaN are false
def steepest_periodic(form: TrigonometricForm, axis: int, enough: float = 0.0) -> float:
    """Bound the slope of the periodic part along an axis, for all θ1 and θ3, and |θ2| <= π/2.

    Args:
        form: U; its quadratic part and its guard are left out.
        axis: The index of the angle.
        enough: A bound, J/rad, that need not be closer.

    Returns:
        The bound, J/rad.
    """
    periodic = replace(form, quadratic=np.zeros((3, 3)), linear=np.zeros(3), guard=None)
    end = np.array([[PI, RANGE_END[1], PI]])
    pending, seen, examined = Boxes(-end, end), 0.0, 0
    single = float(form.steepest[axis])
    while len(pending):
        examined += len(pending)
        if examined > BOX_LIMIT:
            return single
        size, at_centre = _slopes(periodic, pending, axis)
        seen = max(seen, float(at_centre.max()))
        left = pending[~(size <= max(FACTOR * seen, enough))]
        pending = joined([left.halves(left.radius.argmax(axis=1))])
    return min(single, max(FACTOR * seen, enough) * ROUNDING_FACTOR)


def _slopes(form: TrigonometricForm, boxes: Boxes, axis: int) -> tuple[Array, Array]:
    """Return the largest magnitude of the slope over each box, and that at its centre."""
    found = enclosure(form, boxes)
    at_centre = np.abs(found.gradient[:, axis])
    spread = np.einsum("mj,mj->m", np.abs(found.hessian[:, axis]), found.radius)
    return (at_centre + spread + found.curvature[:, axis]) * ROUNDING_FACTOR, at_centre
