"""A lower bound of how high the border of the range lies above the rest state, for all bodies."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.bounds import UP
from rbstab.proof.robust.family import Family, Over
from rbstab.proof.search import Box, Boxes, joined

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
    pending, proved, reachable, examined = joined(list(_faces(family, box)), 3), np.inf, np.inf, 0
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


def _faces(family: Family, box: Box) -> Iterator[Boxes]:
    for axis in range(3):
        for end in (box.lo, box.hi):
            if axis != 1 or family.forms.stop is None:
                lo, hi = box.lo[:, None].copy(), box.hi[:, None].copy()
                lo[axis], hi[axis] = end[axis], end[axis]
                yield Boxes(lo, hi)


def _bounds(over: Over, at_point: Over) -> tuple[Array, Array]:
    """Return lower bounds of U - U(Θ̂) over boxes, and the most that smaller ones can give.

    With the numbers z inside of functions, and the differences d of values and of slopes by z,

        U - U(Θ̂) = d_0 + g_0 δ + d_z0 z + Σ w_j (d_j + g_j δ + d_zj z) + ½ (δ, z)'∂²U (δ, z) - ...
    """
    here, there, r = over.expansion, at_point.expansion, over.radius[:3]
    (v0, g0), (v, g), error = here.middle, here.others, here.error + there.error
    d0, d = v0 - there.middle[0], v - there.others[0]
    slope = np.einsum("im,im->m", np.abs(g0[:3]), r)
    slope = slope + np.abs(g0[3:] - there.middle[1][3:]).sum(axis=0)
    tilted = np.einsum("fim,im->fm", np.abs(g[:, :3]), r)
    tilted = tilted + np.abs(g[:, 3:] - there.others[1][:, 3:]).sum(axis=1)
    spread = np.abs(d).sum(axis=0)
    left = error + here.remainder
    lower = d0 - (slope + spread + tilted.sum(axis=0) + left + here.bend + there.bend) * UP
    # From the terms alone, where a second derivative has no bound; and where U itself has none.
    f0, f, wrong = over.values
    p0, p, wrong_there = at_point.values
    by_terms = np.abs(f - p).sum(axis=0) + wrong + wrong_there + here.remainder
    lower = np.fmax(lower, f0 - p0 - by_terms * UP)
    lower = np.fmax(lower, over.plain_value.lo - at_point.plain_value.hi)
    return lower, d0 - (spread + left) * UP
