"""The proof for one box of bodies, without cutting it: one rest state each, and a level of v."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array
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
    examined = 0
    for boxes, side in _regions(family, box):
        search = _Search(family, minimum, side)
        search.run(boxes, is_late)
        examined += search.examined
        if len(search.doubtful):
            doubtful = np.concatenate([point[None], search.doubtful])
            return PartProof(False, 0.0, examined, doubtful)
    height = border_height(family, minimum.point, box, is_late)
    return PartProof(True, height.lower_bound, examined + height.examined, np.zeros((0, 3)))


def _regions(family: Family, box: Box) -> Iterator[tuple[Boxes, int]]:
    """Yield the range, and the faces at a stop, which can hold a body that would move on."""
    yield one_box(box), 0
    for face, boxes in open_faces(box, [1]) if family.forms.stop is not None else ():
        yield boxes, face[1]


def _inside(inner: Box, outer: Box) -> bool:
    return bool(np.all(inner.lo > outer.lo) and np.all(inner.hi < outer.hi))


def lowest_near(family: Family, near: Array) -> Array | None:
    """Follow Newton's method for the body in the middle to a minimum; None if it finds none."""
    x, last = followed(family.at, near[:, None], NEWTON_STEPS, lambda x: np.zeros(x.shape[1], bool))
    if not last[0] < ARRIVED or np.linalg.eigvalsh(family.at(x)[1][..., 0]).min() <= 0:
        return None
    return x[:, 0]


class _Search:
    """Branch and bound for boxes in which no body has a rest state but the known one.

    Args:
        family: The energies.
        minimum: The rest states of all bodies.
        side: The sign of θ2 on the face of a stop, or 0.
    """

    def __init__(self, family: Family, minimum: Minimum, side: int) -> None:
        self.family, self.minimum, self.side = family, minimum, side
        self.examined, self.doubtful = 0, np.zeros((0, 3))

    @np.errstate(all="ignore")  # comparisons with NaN are false
    def run(self, pending: Boxes, is_late: IsLate) -> None:
        """Examine boxes until all are done, or one of them cannot be."""
        while pending.count and not len(self.doubtful):
            if self.examined >= BOX_LIMIT or is_late():
                self._doubt(pending)
                return
            size = self.family.batch
            batch, pending = pending[slice(-size, None)], pending[slice(0, -size)]
            self.examined += batch.count
            if not self.side:
                batch = batch[~batch.within(self.minimum.domain)]
            if batch.count:
                pending = joined([pending, self._halves(batch)], 3)

    def _doubt(self, boxes: Boxes) -> None:
        self.doubtful = (0.5 * boxes.lo + 0.5 * boxes.hi).T[:MOST_DOUBTFUL]

    def _halves(self, boxes: Boxes) -> Boxes:
        """Return the halves of the boxes that are not done."""
        local = self.family.over(boxes.lo, boxes.hi)
        directions = self._directions(local)
        open_ = ~local.rises(self.side)
        for y in directions:
            open_ &= ~local.excluded(y, self.side)
        left = boxes[open_]
        if not left.count:
            return left
        flat = self._flat(local, directions) & open_
        if flat.any():
            self._doubt(boxes[flat])
        return left.halved(self._axis(local, left.hi - left.lo, open_))

    def _axis(self, local: Over, width: Array, open_: Array) -> Array:
        """Return the axis that spoils the bounds most, if it is not narrow."""
        smear = (np.abs(local.bend.middle[:, :3]).sum(axis=0) * local.radius[:3])[:, open_]
        widest, columns = width.argmax(axis=0), np.arange(width.shape[1])
        axis = np.where(np.all(np.isfinite(smear), axis=0), smear.argmax(axis=0), widest)
        return np.where(width[axis, columns] < 0.2 * width.max(axis=0), widest, axis)

    def _flat(self, local: Over, directions: list[Array]) -> Array:
        """Return at which centres outside the domain no test succeeds, nor in smaller boxes."""
        domain = self.minimum.domain
        inside = (local.centre >= domain.lo[:, None]) & (local.centre <= domain.hi[:, None])
        flat = ~np.all(inside, axis=0) if not self.side else np.ones(local.centre.shape[1], bool)
        flat &= np.all(np.isfinite(local.slope.middle), axis=0)
        for y in directions:
            rise, spread = local.along(y, at_centre=True)
            flat &= ~(np.abs(rise) > spread)
        return flat

    def _directions(self, local: Over) -> list[Array]:
        """Return vectors y that are worth trying, each of shape (3, boxes)."""
        g, H = local.slope.middle, local.bend.middle[:, :3]
        found = [np.broadcast_to(axis[:, None], g.shape) for axis in np.eye(3)]
        steps = np.einsum("ijm,jm->im", inverses(H), g)
        found += [g, steps, local.centre - self.minimum.point[:, None]]
        largest = [np.abs(y).max(axis=0, keepdims=True) for y in found]
        return [
            np.where(np.isfinite(y) & (size > 0), y / size, 0.0)
            for y, size in zip(found, largest, strict=True)
        ]
