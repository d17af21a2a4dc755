"""A lower bound of how high the border of the range lies above the rest state, for all bodies."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box, Boxes, joined
from rbstab.proof.confine import OUTER
from rbstab.proof.enclosures.bounds import UP
from rbstab.proof.model import THETA
from rbstab.proof.regions.landscape import open_faces
from rbstab.proof.robust.family import Family, Over

BOX_LIMIT = 20_000
"""The number of boxes at which the search stops; the bound is then weak."""

TOLERANCE = 3e-3
"""The largest gap between the bound and the best that smaller boxes can give, relative to it."""


@dataclass(frozen=True)
class Height:
    """A proved lower bound of U on the border minus U at a point, J, and the boxes examined."""

    lower_bound: float
    examined: int


@np.errstate(all="ignore")  # comparisons with NaN are false
def border_height(
    family: Family, point: Array, box: Box, is_late: Callable[[], bool] = lambda: False
) -> Height:
    """Bound U(Θ) - U(Θ̂) from below on the border of the range, for each member.

    Args:
        family: The energies.
        point: Θ̂, shape (3,), rad.
        box: The range. Its ends of θ2 do not count if a stop is there.
        is_late: Returns whether the search is to be given up.

    Returns:
        The bound; 0 if it is not positive.
    """
    at_point = family.over(point[:, None], point[:, None])
    pending, proved, reachable, examined = _border(family, box), np.inf, np.inf, 0
    bounds = np.full(pending.count, -np.inf)
    while pending.count and examined < BOX_LIMIT and reachable > 0 and not is_late():
        # Those with the lowest bounds first: the least of all bounds is that of the border.
        order = np.argsort(bounds, kind="stable")
        first, others = order[: family.batch], order[family.batch :]
        batch, pending, bounds = pending[first], pending[others], bounds[others]
        examined += batch.count
        lower, best = _bounds(family.over(batch.lo, batch.hi), at_point)
        # No division can give more: this point stays in one of the boxes.
        reachable = min(reachable, float(np.nanmin(best, initial=np.inf)))
        lower = np.where(np.isnan(lower), -np.inf, lower)
        finished = lower > reachable * (1 - TOLERANCE)
        proved = min(proved, float(lower[finished].min(initial=np.inf)))
        left = batch[~finished]
        halves = left.halved((left.hi - left.lo).argmax(axis=0))
        pending = joined([pending, halves], 3)
        bounds = np.concatenate([bounds, np.tile(lower[~finished], 2)])
    proved = min(proved, float(bounds.min(initial=np.inf)))
    return Height(max(0.0, proved) if np.isfinite(proved) else 0.0, examined)


def _border(family: Family, box: Box) -> Boxes:
    open_axes = THETA if family.forms.stop is None else OUTER
    return joined([one for _, one in open_faces(box, open_axes)], 3)


def _bounds(over: Over, at_point: Over) -> tuple[Array, Array]:
    """Return lower bounds of U - U(Θ̂) over boxes, and the most that smaller ones can give.

    With the numbers z inside of functions, and the differences d of values and of slopes by z,

        U - U(Θ̂) = d_0 + g_0 δ + d_z0 z + Σ w_j (d_j + g_j δ + d_zj z) + ½ (δ, z)'∂²U (δ, z) - ...
    """
    family, r = over.family, over.radius
    rows = np.concatenate([[0], family.first])
    here, there = family.sums(over.c, rows), family.sums(at_point.c, rows)
    d = here.middle - there.middle
    tilted = here.others - there.others
    # Θ̂ is a point, so only the slopes by z are differences.
    d[1:4], tilted[:, 1:4] = here.middle[1:4], here.others[:, 1:4]
    spread = np.abs(tilted[:, 0]).sum(axis=0) + here.error[0] + there.error[0]
    spread = spread + np.einsum("im,im->m", here.error[1:] + there.error[1:], r)
    spread = spread + over.remainder[0]
    slope = np.einsum("im,im->m", np.abs(d[1:]) + np.abs(tilted[:, 1:]).sum(axis=0), r)
    bend = _bend(over) + _bend(at_point)
    lower = d[0] - (slope + spread + bend) * UP
    # From the terms alone, where a second derivative or U itself has no bound.
    lower = np.fmax(lower, over.plain_value.lo - at_point.plain_value.hi)
    return lower, d[0] - spread * UP


def _bend(over: Over) -> Array:
    sizes = over.family.sizes(over.o, over.family.second)
    return np.asarray(0.5 * np.einsum("ijm,im,jm->m", sizes, over.radius, over.radius) * UP)
