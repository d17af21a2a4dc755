"""The proof for one box of bodies, without cutting it: one rest state each, and a level of v."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.proof.boxes import Box, Boxes, joined, one_box
from rbstab.proof.enclosures.bounds import inverses
from rbstab.proof.model import RANGE_END
from rbstab.proof.regions.landscape import open_faces
from rbstab.proof.robust.family import Family, Over
from rbstab.proof.robust.heights import border_height
from rbstab.proof.robust.minimum import Minimum, minimum_near
from rbstab.proof.zeros import followed

BOX_LIMIT = 20_000
"""The number of boxes of Θ at which the proof of one box of bodies stops."""

MOST_DOUBTFUL = 16
"""The largest number of doubtful points that are kept."""

NEWTON_STEPS = 40

ARRIVED = 1e-12
"""A shorter step of Newton's method has arrived."""

IsLate = Callable[[], bool]


@dataclass(frozen=True, eq=False)
class PartProof:
    """What is proved for all bodies in one box.

    If `proved`, each of them has exactly one rest state in the range of eq. 5. It is a minimum, and
    U on the border is higher by at least `level`, J (0: not proved).

    doubtful are points at which the gradient of some energy of the family may be zero, shape
    (n, 3), rad; they show where to look for a second rest state.
    """

    proved: bool
    level: float
    examined: int
    doubtful: Array


def range_of(family: Family) -> Box:
    """Return the closed range of eq. 5, or what a stop leaves of it, rounded outwards."""
    stop = family.forms.stop
    end = RANGE_END if stop is None else np.minimum(RANGE_END, [np.inf, stop, np.inf])
    return Box(-end, end)


def prove_part(family: Family, near: Array, is_late: IsLate = lambda: False) -> PartProof:
    """Prove that each member of a family has one rest state, a minimum, and bound its level.

    Args:
        family: The energies.
        near: A point near the rest states, shape (3,), rad.
        is_late: Returns whether the proof is to be given up.
    """
    found = lowest_near(family, near)
    point = near if found is None else found
    minimum = minimum_near(family, point)
    box = range_of(family)
    if minimum is None or not _inside(minimum.enclosure, box):
        return PartProof(False, 0.0, 0, point[None])
    # The range, and the faces at a stop, which can hold a body that would move on.
    faces = open_faces(box, [PITCH]) if family.forms.stop is not None else ()
    examined = 0
    for side, boxes in ((0, one_box(box)), *((face[1], boxes) for face, boxes in faces)):
        count, doubtful = _searched(family, minimum, boxes, side, is_late)
        examined += count
        if len(doubtful):
            return PartProof(False, 0.0, examined, np.vstack([point, doubtful]))
    height = border_height(family, minimum.point, box, is_late)
    return PartProof(True, height.lower_bound, examined + height.examined, np.zeros((0, 3)))


def _inside(inner: Box, outer: Box) -> bool:
    return bool(np.all(inner.lo > outer.lo) and np.all(inner.hi < outer.hi))


def lowest_near(family: Family, near: Array) -> Array | None:
    """Follow Newton's method for the body in the middle to a minimum; None if it finds none."""
    x, last = followed(family.at, near[:, None], NEWTON_STEPS, lambda x: np.zeros(x.shape[1], bool))
    if not last[0] < ARRIVED or np.linalg.eigvalsh(family.at(x)[1][..., 0]).min() <= 0:
        return None
    return x[:, 0]


@np.errstate(all="ignore")  # comparisons with NaN are false
def _searched(
    family: Family, minimum: Minimum, pending: Boxes, side: int, is_late: IsLate
) -> tuple[int, Array]:
    """Exclude boxes, by branch and bound, in which no body has a rest state but the known one.

    Args:
        family: The energies.
        minimum: The rest states of all bodies.
        pending: The boxes.
        side: The sign of θ2 on the face of a stop, or 0.
        is_late: Returns whether the search is to be given up.

    Returns:
        The number of boxes that were examined; and some points at which a body may rest, or at
        which the search was given up, shape (n, 3), rad. Without any, all boxes are excluded.
    """
    examined, domain = 0, minimum.domain
    while pending.count:
        if examined >= BOX_LIMIT or is_late():
            return examined, _centres(pending)
        size = family.batch
        batch, pending = pending[slice(-size, None)], pending[slice(0, -size)]
        examined += batch.count
        if not side:
            batch = batch[~batch.within(domain)]
        if not batch.count:
            continue
        local = family.over(batch.lo, batch.hi)
        directions = _directions(local, minimum.point)
        left = ~local.rises(side)
        for y in directions:
            left &= ~local.excluded(y, side)
        if not left.any():
            continue
        # Where no test succeeds at the centre, none does in smaller boxes about it.
        flat = left & np.all(np.isfinite(local.slope.middle), axis=0)
        if not side:
            inside = np.clip(local.centre.T, domain.lo, domain.hi) == local.centre.T
            flat &= ~inside.all(axis=1)
        for y in directions:
            rise, spread = local.along(y, at_centre=True)
            flat &= ~(np.abs(rise) > spread)
        if flat.any():
            return examined, _centres(batch[flat])
        pending = joined([pending, batch[left].halved(_axis(local, batch, left))], 3)
    return examined, np.zeros((0, 3))


def _centres(boxes: Boxes) -> Array:
    return (0.5 * boxes.lo + 0.5 * boxes.hi).T[:MOST_DOUBTFUL]


def _axis(local: Over, boxes: Boxes, left: Array) -> Array:
    """Return the axis that spoils the bounds of the boxes that are left most, if not narrow."""
    width = (boxes.hi - boxes.lo)[:, left]
    smear = (np.abs(local.bend.middle[:, :3]).sum(axis=0) * local.radius[:3])[:, left]
    widest, columns = width.argmax(axis=0), np.arange(width.shape[1])
    axis = np.where(np.all(np.isfinite(smear), axis=0), smear.argmax(axis=0), widest)
    return np.where(width[axis, columns] < 0.2 * width.max(axis=0), widest, axis)


def _directions(local: Over, point: Array) -> list[Array]:
    """Return vectors y that are worth trying, each of shape (3, boxes)."""
    g, H = local.slope.middle, local.bend.middle[:, :3]
    steps = np.einsum("ijm,jm->im", inverses(H), g)
    axes = (np.broadcast_to(axis[:, None], g.shape) for axis in np.eye(3))
    found = [*axes, g, steps, local.centre - point[:, None]]
    largest = [np.abs(y).max(axis=0, keepdims=True) for y in found]
    return [
        np.where(np.isfinite(y) & (size > 0), y / size, 0.0)
        for y, size in zip(found, largest, strict=True)
    ]
