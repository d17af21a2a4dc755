"""Cells of a range: cubes, near enough, that are divided into eighths, and their neighbours."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box, Boxes

FIRST_DEPTH = 1
"""Cells are halved so often along the shortest side at first."""

DEEPEST = 17
"""Halvings after which a cell is left as it is: three places then fit in one whole number."""

MOST_ROOTS = 7
"""Cells along one side of the range, before they are halved."""


class Cells:
    """Cells of a range: of depth d, and with the numbers of their places, shape (3, cells)."""

    def __init__(self, box: Box, roots: Array, depth: Array, place: Array) -> None:
        self.box, self.roots, self.depth, self.place = box, roots, depth, place

    @classmethod
    def of(cls, box: Box, depth: int = FIRST_DEPTH) -> "Cells":
        """Return the cells of a range, all of one depth, near cubes."""
        width = box.hi - box.lo
        roots = np.clip(np.rint(width / width.min()), 1, MOST_ROOTS).astype(np.int64)
        lines = [np.arange(n << depth) for n in roots]
        place = np.stack([x.ravel() for x in np.meshgrid(*lines, indexing="ij")])
        return cls(box, roots, np.full(place.shape[1], depth), place)

    def __getitem__(self, some: Array) -> "Cells":
        return Cells(self.box, self.roots, self.depth[some], self.place[:, some])

    @property
    def count(self) -> int:
        """Their number."""
        return len(self.depth)

    @property
    def boxes(self) -> Boxes:
        """The cells as boxes: the same doubles for a common end of two cells."""
        return Boxes(self._ends(self.place), self._ends(self.place + 1))

    def _ends(self, place: Array) -> Array:
        share = place / (self.roots[:, None] << self.depth)
        low, high = self.box.lo[:, None], self.box.hi[:, None]
        return np.where(share >= 1, high, np.minimum(low + (high - low) * share, high))

    def eighths(self) -> "Cells":
        """Return the eight parts of each: the first part of all, the second of all, and so on."""
        corners = np.stack([x.ravel() for x in np.meshgrid(*[[0, 1]] * 3, indexing="ij")])
        place = (2 * self.place[:, None, :] + corners[:, :, None]).reshape(3, -1)
        return Cells(self.box, self.roots, np.tile(self.depth + 1, 8), place)

    def joined(self, other: "Cells") -> "Cells":
        """Return both."""
        depth = np.concatenate([self.depth, other.depth])
        place = np.concatenate([self.place, other.place], 1)
        return Cells(self.box, self.roots, depth, place)

    def find(self, place: Array) -> Array:
        """Return the cell in which each of the smallest cells is, of cells that fill the range.

        Args:
            place: The places of cells of depth `DEEPEST`, shape (3, places).

        Returns:
            The numbers of the cells; -1 outside the range.
        """
        # Along Morton's curve, a cell is all between its first place and that of the next cell.
        first = _along_curve(self._corners)
        order = np.argsort(first)
        at = order[np.searchsorted(first[order], _along_curve(place), side="right") - 1]
        outside = np.any((place < 0) | (place >= (self.roots << DEEPEST)[:, None]), axis=0)
        return np.where(outside, -1, at)

    @property
    def _corners(self) -> Array:
        return self.place << (DEEPEST - self.depth)

    def neighbours(self, some: Array | None = None) -> tuple[Array, Array]:
        """Return all pairs of cells with a common face, each pair once.

        Args:
            some: Cells, of which at least the smaller one of each pair is one; by default all.
        """
        asked = np.arange(self.count) if some is None else some
        corner, size = self._corners[:, asked], 1 << (DEEPEST - self.depth[asked])
        sides = []
        for axis in range(3):
            for step in (-1, size):
                place = corner.copy()
                place[axis] += step
                sides.append(place)
        one, two = np.tile(asked, 6), self.find(np.concatenate(sides, 1))
        # Of a larger cell the place tells only one of its smaller neighbours: these find it.
        good = (two >= 0) & (self.depth[two] <= self.depth[one])
        first, second = np.minimum(one, two)[good], np.maximum(one, two)[good]
        _, once = np.unique(first * self.count + second, return_index=True)
        return first[once], second[once]


def _along_curve(place: Array) -> Array:
    """Return the numbers of places along Morton's curve: their bits by turns."""
    bits = np.maximum(place, 0)
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        bits = (bits | (bits << shift)) & mask
    return (bits[0] << 2) | (bits[1] << 1) | bits[2]
