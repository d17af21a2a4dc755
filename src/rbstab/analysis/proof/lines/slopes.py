"""A proved bound on the slope of the periodic part of an energy with lines, by branch and bound.

The bounds of single terms add up to far more than the slope: those of a spring nearly cancel.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rbstab.analysis.proof.boxes import PI, RANGE_END, ROUNDING_FACTOR, Boxes, joined
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

BOX_LIMIT = 40_000
"""The number of boxes at which the search stops: along the axes for which some are left, the bound
is then that of single terms."""

FACTOR = 1.3
"""The bound is this times the largest slope that was seen. A closer one would take longer, and its
check too."""


@np.errstate(all="ignore")  # comparisons with NaN are false
def steepest_periodic(
    form: TrigonometricForm, axes: Sequence[int], enough: Array | float = 0.0
) -> Array:
    """Bound the slopes of the periodic part along some axes, for all θ1 and θ3, and |θ2| <= π/2.

    Args:
        form: U; its quadratic part and its guard are left out.
        axes: The indices of the angles, n of them.
        enough: Bounds, J/rad, that need not be closer, shape (n,) or one number.

    Returns:
        The bounds, shape (n,), J/rad.
    """
    periodic = replace(form, quadratic=np.zeros((3, 3)), linear=np.zeros(3), guard=None)
    end = np.array([[PI, RANGE_END[1], PI]])
    chosen = np.asarray(axes)
    single = form.steepest[chosen]
    pending, seen, examined = Boxes(-end, end), np.zeros(len(chosen)), 0
    # Along which axes the slope in a box may be above the bound.
    above = np.ones((1, len(chosen)), dtype=bool)
    while len(pending):
        examined += len(pending)
        if examined > BOX_LIMIT:
            break
        size, at_centre = _slopes(periodic, pending, chosen)
        # Where a box has no bound yet, its centre may have no number.
        seen = np.fmax(seen, np.fmax.reduce(at_centre, axis=0))
        above &= ~(size <= np.maximum(FACTOR * seen, enough))
        left = np.asarray(above.any(axis=1))
        pending, above = pending[left], above[left]
        pending = joined([pending.halves(pending.radius.argmax(axis=1))])
        above = np.concatenate([above, above])
    found = np.minimum(single, np.maximum(FACTOR * seen, enough) * ROUNDING_FACTOR)
    return np.where(above.any(axis=0), single, found)


def _slopes(form: TrigonometricForm, boxes: Boxes, axes: Array) -> tuple[Array, Array]:
    """Return the largest magnitudes of the slopes over each box, and those at its centre."""
    found = enclosure(form, boxes)
    at_centre = np.abs(found.gradient[:, axes])
    spread = np.einsum("mkj,mj->mk", np.abs(found.hessian[:, axes]), found.radius)
    return (at_centre + spread + found.curvature[:, axes]) * ROUNDING_FACTOR, at_centre
