"""A lower bound of how high the border of the range lies above the rest state, for all bodies."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.proof.boxes import joined
from rbstab.analysis.proof.certified_region import Face
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.least_value import lower_bounds
from rbstab.analysis.proof.robust.family import FormFamily

BATCH = 2048

BOX_LIMIT = 60_000
"""The number of boxes at which the search stops; the bound is then weak."""

TOLERANCE = 1e-3
"""The largest gap between the bound and the best that smaller boxes can give, relative to it."""


@dataclass(frozen=True)
class Height:
    """A proved lower bound of U on the border minus U at a point, J, and the boxes examined."""

    lower_bound: float
    examined: int


@np.errstate(all="ignore")  # comparisons with NaN are false
def border_height(family: FormFamily, box_limit: int = BOX_LIMIT) -> Height:
    """Bound U(Θ) - U(Θ̂) from below on the border of the range of eq. 5, for each member.

    Args:
        family: The family `above` the point Θ̂.
        box_limit: The number of boxes at which the search stops.

    Returns:
        The bound; 0 if it is not positive.
    """
    pending, proved, reachable, examined = joined([face.box for face in Face]), np.inf, np.inf, 0
    while len(pending) and examined < box_limit and reachable > 0:
        batch, pending = pending[-BATCH:], pending[:-BATCH]
        examined += len(batch)
        enclosed = enclosure(family, batch)
        # No division can give more: this point stays in one of the boxes.
        reachable = min(reachable, float((enclosed.value - enclosed.value_error).min()))
        lower = lower_bounds(enclosed)
        finished = lower > reachable * (1 - TOLERANCE)
        proved = min(proved, float(lower[finished].min(initial=np.inf)))
        left = batch[~finished]
        pending = joined([pending, left.halves(left.radius.argmax(axis=1))])
    if len(pending):
        proved = min(proved, float(lower_bounds(enclosure(family, pending)).min()))
    return Height(max(0.0, proved) if np.isfinite(proved) else 0.0, examined)
