"""A lower bound of how high the border of the range lies above the rest state, for all bodies."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box, Boxes, joined
from rbstab.proof.confine import OUTER
from rbstab.proof.enclosures.bounds import UP
from rbstab.proof.model import THETA
from rbstab.proof.regions.landscape import open_faces
from rbstab.proof.robust.family import Family, Over
from rbstab.proof.robust.halving import IsLate, halved

TOLERANCE = 3e-3
"""The largest gap between the bound and the best that smaller boxes can give, relative to it."""


def border_height(
    family: Family, point: Array, box: Box, is_late: IsLate = lambda: False
) -> tuple[float, int]:
    """Bound U(Θ) - U(Θ̂) from below on the border of the range, for each member.

    Args:
        family: The energies.
        point: Θ̂, shape (3,), rad.
        box: The range. Its ends of θ2 do not count if a stop is there.
        is_late: Returns whether the search is to be given up.

    Returns:
        The bound, J, 0 if it is not positive; and the number of boxes that were examined.
    """
    at_point = family.over(point[:, None], point[:, None])
    open_axes = THETA if family.energies.stop is None else OUTER
    border = joined([faces for _, faces in open_faces(box, open_axes)], 3)
    proved = reachable = np.inf

    def bounds(boxes: Boxes) -> tuple[Array, Array]:
        lower, best = _bounds(family.over(*boxes), at_point)
        return np.where(np.isnan(lower), -np.inf, lower), best

    def is_left(boxes: Boxes) -> Array:
        nonlocal proved, reachable
        lower, best = bounds(boxes)
        # No division can give more: this point stays in one of the boxes.
        reachable = min(reachable, float(np.nanmin(best, initial=np.inf)))
        done = lower > reachable * (1 - TOLERANCE)
        proved = min(proved, float(lower[done].min(initial=np.inf)))
        return ~done

    def is_over() -> bool:
        return reachable <= 0 or is_late()

    examined, left = halved(border, family.batch, is_left, is_over)
    if reachable > 0:
        for k in range(0, left.count, family.batch):
            lowest = bounds(left[slice(k, k + family.batch)])[0].min()
            proved = min(proved, float(lowest))
    return (max(0.0, proved) if reachable > 0 and np.isfinite(proved) else 0.0), examined


def _bounds(over: Over, at_point: Over) -> tuple[Array, Array]:
    """Return lower bounds of U - U(Θ̂) over boxes, and the most that smaller ones can give.

    With the numbers z inside of functions, and the differences d of values and of slopes by z,

        U - U(Θ̂) = d_0 + g_0 δ + d_z0 z + Σ w_j (d_j + g_j δ + d_zj z) + ½ (δ, z)'∂²U (δ, z) - ...
    """
    here, there, r = over.linear, at_point.linear, over.radius
    # Θ̂ is a point, so only U and its slopes by z are differences.
    differs = np.ones((len(r) + 1, 1))
    differs[1:4] = 0.0
    d = here.middle - differs * there.middle
    tilted = np.abs(here.others - differs * there.others).sum(axis=0)
    spread = tilted[0] + here.error[0] + there.error[0] + over.remainder[0]
    spread = spread + np.einsum("im,im->m", here.error[1:] + there.error[1:], r)
    slope = np.einsum("im,im->m", np.abs(d[1:]) + tilted[1:], r)
    lower = d[0] - (slope + spread + _bend(over) + _bend(at_point)) * UP
    # From the terms alone, where a second derivative or U itself has no bound.
    lower = np.fmax(lower, over.plain.lo[0] - at_point.plain.hi[0])
    return lower, d[0] - spread * UP


def _bend(over: Over) -> Array:
    sizes = over.family.sizes(over.o, over.family.second)
    return np.asarray(0.5 * np.einsum("ijm,im,jm->m", sizes, over.radius, over.radius) * UP)
