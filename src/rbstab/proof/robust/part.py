"""The proof for one box of bodies, without cutting it: one rest state each, and a level of v.

The level is a lower bound of how high the border of the range lies above the rest state.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.proof.boxes import Box, Boxes, as_boxes, joined
from rbstab.proof.confine import OUTER
from rbstab.proof.enclosures.bounds import UP, inverses
from rbstab.proof.model import RANGE_END, THETA
from rbstab.proof.regions.landscape import open_faces
from rbstab.proof.robust.family import Family, Over
from rbstab.proof.robust.minimum import Minimum, lowest_near, minimum_near

BOX_LIMIT = 20_000
"""The number of boxes of Θ at which a search for one box of bodies stops."""

MOST_DOUBTFUL = 16
"""The largest number of doubtful points that are kept."""

TOLERANCE = 3e-3
"""The largest gap between a level and the best that smaller boxes can give, relative to it."""

IsLate = Callable[[], bool]


@dataclass(frozen=True, eq=False)
class PartProof:
    """What is proved for all bodies in one box.

    If `proved`, each of them has exactly one rest state in the range of eq. 5. It is a minimum, and
    U on the border is higher by at least `level`, J (0: not proved).

    doubtful are points at which the gradient of some energy of the family may be zero, shape
    (n, 3), rad; they show where to look for a second rest state. It is empty if `proved`.
    """

    proved: bool
    level: float
    examined: int
    doubtful: Array


def range_of(family: Family) -> Box:
    """Return the closed range of eq. 5, or what a stop leaves of it, rounded outwards."""
    stop = family.energies.stop
    end = RANGE_END if stop is None else np.minimum(RANGE_END, [np.inf, stop, np.inf])
    return Box(-end, end)


def starts_in_range() -> Array:
    """Return points from which rest states are looked for, zero first, shape (3, points), rad."""
    grid = product(*(np.linspace(-a, a, n) for a, n in ((2.8, 5), (1.3, 3), (2.8, 5))))
    return np.array([(0.0, 0.0, 0.0), *grid]).T


def prove_part(family: Family, is_late: IsLate = lambda: False) -> PartProof:
    """Prove that each member of a family has one rest state, a minimum, and bound its level.

    Args:
        family: The energies.
        is_late: Returns whether the proof is to be given up.
    """
    point, box = lowest_near(family, starts_in_range()), range_of(family)
    minimum = minimum_near(family, point)
    if minimum is None or not as_boxes(minimum.enclosure).within(box)[0]:
        return PartProof(False, 0.0, 0, point[None])
    # The range, and the faces at a stop, which can hold a body that would move on.
    faces = open_faces(box, [PITCH]) if family.energies.stop is not None else ()
    examined = 0
    for side, boxes in ((0, as_boxes(box)), *((face[1], boxes) for face, boxes in faces)):
        count, doubtful = _searched(family, minimum, boxes, side, is_late)
        examined += count
        if len(doubtful):
            return PartProof(False, 0.0, examined, np.vstack([point, doubtful]))
    level, count = border_height(family, point, box, is_late)
    return PartProof(True, level, examined + count, np.zeros((0, 3)))


@np.errstate(all="ignore")  # comparisons with NaN are false
def halved(
    boxes: Boxes, batch: int, is_left: Callable[[Boxes], Array], is_late: IsLate
) -> tuple[int, Boxes]:
    """Examine boxes in batches, and then what is left of them.

    Args:
        boxes: The boxes.
        batch: So many are examined at once.
        is_left: Returns which boxes of a batch are not done; they are halved along their widest
            axis.
        is_late: Returns whether the search is to be given up.

    Returns:
        The number of boxes that were examined, and the boxes that are not done.
    """
    examined = 0
    while boxes.count and examined < BOX_LIMIT and not is_late():
        some, boxes = boxes[slice(-batch, None)], boxes[slice(0, -batch)]
        examined += some.count
        left = some[is_left(some)]
        boxes = joined([boxes, left.halved((left.hi - left.lo).argmax(axis=0))], 3)
    return examined, boxes


def _searched(
    family: Family, minimum: Minimum, boxes: Boxes, side: int, is_late: IsLate
) -> tuple[int, Array]:
    """Exclude boxes, by branch and bound, in which no body has a rest state but the known one."""
    domain, flat = minimum.domain, boxes[slice(0, 0)]

    def is_left(some: Boxes) -> Array:
        nonlocal flat
        local = family.over(*some)
        # The side is the sign of θ2 on the face of a stop, or 0.
        left = ~local.rises(side)
        if not side:
            left &= ~some.within(domain)
        # Where no test succeeds at the centre, none does in smaller boxes about it.
        never = np.all(np.isfinite(local.slope.middle), axis=0)
        if not side:
            never &= ~Boxes(local.centre, local.centre).within(domain)
        for y in _directions(local, minimum.point):
            excluded, at_centre = local.excluded(y, side)
            left, never = left & ~excluded, never & ~at_centre
        flat = some[left & never]
        return left

    examined, pending = halved(boxes, family.batch, is_left, lambda: flat.count > 0 or is_late())
    doubtful = flat if flat.count else pending
    # Points, shape (n, 3), rad, at which a body may rest, or at which the search was given up.
    # Without any, all boxes are excluded.
    return examined, (0.5 * doubtful.lo + 0.5 * doubtful.hi).T[:MOST_DOUBTFUL]


def _directions(local: Over, point: Array) -> list[Array]:
    """Return vectors y that are worth trying, each of shape (3, boxes)."""
    g, H = local.slope.middle, local.bend.middle[:, :3]
    steps = np.einsum("ijm,jm->im", inverses(H), g)
    axes = (np.broadcast_to(axis[:, None], g.shape) for axis in np.eye(3))
    return [*axes, g, steps, local.centre - point[:, None]]


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
    """Return lower bounds of U - U(Θ̂) over boxes, and the most that smaller ones can give."""
    # With the numbers z inside of functions, and the differences d of values and of slopes by z,
    #     U - U(Θ̂) = d_0 + g_0 δ + d_z0 z + Σ w_j (d_j + g_j δ + d_zj z) + ½ (δ, z)'∂²U (δ, z) - ...
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
