"""The proof for one box of bodies, without cutting it: one rest state each, and a level of v."""

from dataclasses import dataclass
from itertools import product

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.proof.boxes import Box, Boxes, one_box
from rbstab.proof.enclosures.bounds import inverses
from rbstab.proof.model import RANGE_END
from rbstab.proof.regions.landscape import open_faces
from rbstab.proof.robust.family import Family, Over
from rbstab.proof.robust.halving import IsLate, halved
from rbstab.proof.robust.heights import border_height
from rbstab.proof.robust.minimum import Minimum, lowest_near, minimum_near

MOST_DOUBTFUL = 16
"""The largest number of doubtful points that are kept."""


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
    if minimum is None or not one_box(minimum.enclosure).within(box)[0]:
        return PartProof(False, 0.0, 0, point[None])
    # The range, and the faces at a stop, which can hold a body that would move on.
    faces = open_faces(box, [PITCH]) if family.energies.stop is not None else ()
    examined = 0
    for side, boxes in ((0, one_box(box)), *((face[1], boxes) for face, boxes in faces)):
        count, doubtful = _searched(family, minimum, boxes, side, is_late)
        examined += count
        if len(doubtful):
            return PartProof(False, 0.0, examined, np.vstack([point, doubtful]))
    level, count = border_height(family, point, box, is_late)
    return PartProof(True, level, examined + count, np.zeros((0, 3)))


def _searched(
    family: Family, minimum: Minimum, boxes: Boxes, side: int, is_late: IsLate
) -> tuple[int, Array]:
    """Exclude boxes, by branch and bound, in which no body has a rest state but the known one.

    Args:
        family: The energies.
        minimum: The rest states of all bodies.
        boxes: The boxes.
        side: The sign of θ2 on the face of a stop, or 0.
        is_late: Returns whether the search is to be given up.

    Returns:
        The number of boxes that were examined; and some points at which a body may rest, or at
        which the search was given up, shape (n, 3), rad. Without any, all boxes are excluded.
    """
    domain, flat = minimum.domain, boxes[slice(0, 0)]

    def is_left(some: Boxes) -> Array:
        nonlocal flat
        local = family.over(*some)
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
        flat = some[never]
        return left

    examined, pending = halved(boxes, family.batch, is_left, lambda: flat.count > 0 or is_late())
    doubtful = flat if flat.count else pending
    return examined, (0.5 * doubtful.lo + 0.5 * doubtful.hi).T[:MOST_DOUBTFUL]


def _directions(local: Over, point: Array) -> list[Array]:
    """Return vectors y that are worth trying, each of shape (3, boxes)."""
    g, H = local.slope.middle, local.bend.middle[:, :3]
    steps = np.einsum("ijm,jm->im", inverses(H), g)
    axes = (np.broadcast_to(axis[:, None], g.shape) for axis in np.eye(3))
    return [*axes, g, steps, local.centre - point[:, None]]
