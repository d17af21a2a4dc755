"""Boxes of angles, many at once, and the range of eq. 5 as a box."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array

PI = np.nextafter(np.pi, np.inf)
"""The smallest double above π; `np.pi` is below π."""

ROUNDING_FACTOR = 1 + 1e-12
"""A factor that exceeds the rounding error of a sum of about a dozen magnitudes."""

RANGE_END = np.array([PI, PI / 2, PI])
"""rad: the largest |θ1|, |θ2| and |θ3| in the closed range of eq. 5, rounded outwards."""


@dataclass(frozen=True, eq=False)
class Boxes:
    """Closed boxes low <= Θ <= high, both of shape (m, 3), rad."""

    low: Array
    high: Array

    def __len__(self) -> int:
        return len(self.low)

    def __getitem__(self, chosen: Array | slice) -> "Boxes":
        return Boxes(self.low[chosen], self.high[chosen])

    @property
    def centre(self) -> Array:
        """A point in the middle of each box, shape (m, 3)."""
        return 0.5 * (self.low + self.high)

    @property
    def radius(self) -> Array:
        """The radius: the largest distance from `centre` by axis, rounded up, shape (m, 3)."""
        centre = self.centre
        return np.nextafter(np.maximum(self.high - centre, centre - self.low), np.inf)

    @property
    def inner_radius(self) -> Array:
        """The least distance from `centre` to the border by axis, rounded down, shape (m, 3)."""
        centre = self.centre
        return np.nextafter(np.minimum(self.high - centre, centre - self.low), -np.inf)

    def within(self, other: "Boxes") -> Array:
        """Return whether each box lies inside a single other box, shape (m,)."""
        return np.all((self.low >= other.low) & (self.high <= other.high), axis=1)

    def intersects(self, other: "Boxes") -> Array:
        """Return whether each box has a point in common with a single other box, shape (m,)."""
        return np.all((self.low <= other.high) & (self.high >= other.low), axis=1)

    def halves(self, axis: Array) -> "Boxes":
        """Cut each box in two along its axis. The halves share a face, so they cover the box."""
        rows, middle = np.arange(len(self)), self.centre
        left, right = self.high.copy(), self.low.copy()
        left[rows, axis] = right[rows, axis] = middle[rows, axis]
        return joined([Boxes(self.low, left), Boxes(right, self.high)])


def grid(end: Array, counts: Sequence[int]) -> Boxes:
    """Return equal boxes that cover -end <= Θ <= end.

    Args:
        end: The largest |Θ|, shape (n,).
        counts: Their number along each axis.
    """
    edges = [np.linspace(-b, b, count + 1) for b, count in zip(end, counts, strict=True)]
    low, high = (
        np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, len(edges))
        for ends in ([edge[:-1] for edge in edges], [edge[1:] for edge in edges])
    )
    return Boxes(low, high)


def box_around(point: Array, radius: Array | float) -> Boxes:
    """Return one box about a point, rounded outwards."""
    low, high = np.nextafter(point - radius, -np.inf), np.nextafter(point + radius, np.inf)
    return Boxes(low[np.newaxis], high[np.newaxis])


def joined(parts: list[Boxes]) -> Boxes:
    """Return the boxes of several `Boxes` in one `Boxes`."""
    return Boxes(
        np.concatenate([part.low for part in parts]), np.concatenate([part.high for part in parts])
    )


def whole_range(end: Array = RANGE_END) -> Boxes:
    """Return the box -end <= Θ <= end; by default the closed range of eq. 5."""
    return Boxes(-end[np.newaxis], end[np.newaxis].copy())


def no_boxes() -> Boxes:
    """Return an empty set of boxes."""
    return Boxes(np.zeros((0, 3)), np.zeros((0, 3)))


def hulls(boxes: Boxes) -> Boxes:
    """Merge boxes that touch into their hull; the hulls cover all given boxes."""
    for axis in range(3):
        boxes = _rows_joined(boxes, axis)
    found = []
    while len(boxes):
        hull, members = boxes[:1], boxes.intersects(boxes[:1])
        while np.any(members):
            taken = joined([hull, boxes[members]])
            hull = Boxes(taken.low.min(axis=0)[np.newaxis], taken.high.max(axis=0)[np.newaxis])
            boxes = boxes[~members]
            members = boxes.intersects(hull)
        found.append(hull)
    return joined([no_boxes(), *found])


def _rows_joined(boxes: Boxes, axis: int) -> Boxes:
    """Return one box for each row of boxes along an axis that touch and are equal in the others.

    A search leaves thousands of boxes that fill a part of the range; few remain.
    """
    others = [k for k in range(3) if k != axis]
    across = np.hstack([boxes.low[:, others], boxes.high[:, others]])
    order = np.lexsort([boxes.low[:, axis], *across.T])
    low, high, across = boxes.low[order], boxes.high[order], across[order]
    goes_on = np.all(across[1:] == across[:-1], axis=1) & (low[1:, axis] <= high[:-1, axis])
    starts = np.flatnonzero(np.concatenate([[True], ~goes_on])[: len(low)])
    if not len(starts):
        return boxes
    return Boxes(low[starts], np.maximum.reduceat(high, starts, axis=0))
