"""Boxes of angles, many at once, and the range of eq. 5 as one of them."""

from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array

PI = np.nextafter(np.pi, np.inf)
"""The least double above π: the double called pi is below it."""

RANGE_END = np.array([PI, PI / 2, PI])
"""rad: |θ1|, |θ2|, |θ3| up to here are the closed range of eq. 5, and a rounding more."""


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
    def reach(self) -> Array:
        """How far each box reaches from its `centre` along each axis, rounded up, shape (m, 3)."""
        centre = self.centre
        return np.nextafter(np.maximum(self.high - centre, centre - self.low), np.inf)

    def within(self, other: "Boxes") -> Array:
        """Whether each box lies in a single other one, shape (m,)."""
        return np.all((self.low >= other.low) & (self.high <= other.high), axis=1)

    def meets(self, other: "Boxes") -> Array:
        """Whether each box has a point in common with a single other one, shape (m,)."""
        return np.all((self.low <= other.high) & (self.high >= other.low), axis=1)

    def halves(self, axis: Array) -> "Boxes":
        """Each box cut in two along its axis; the halves share a face, so nothing is lost."""
        rows, middle = np.arange(len(self)), self.centre
        left, right = self.high.copy(), self.low.copy()
        left[rows, axis] = right[rows, axis] = middle[rows, axis]
        return joined([Boxes(self.low, left), Boxes(right, self.high)])


def box_around(point: Array, reach: Array | float) -> Boxes:
    """One box about a point, rounded outwards."""
    low, high = np.nextafter(point - reach, -np.inf), np.nextafter(point + reach, np.inf)
    return Boxes(low[np.newaxis], high[np.newaxis])


def joined(parts: list[Boxes]) -> Boxes:
    """All boxes of several lots."""
    return Boxes(
        np.concatenate([part.low for part in parts]), np.concatenate([part.high for part in parts])
    )


def whole_range() -> Boxes:
    """The closed range of eq. 5 as one box."""
    return Boxes(-RANGE_END[np.newaxis], RANGE_END[np.newaxis].copy())


def no_boxes() -> Boxes:
    """No box at all."""
    return Boxes(np.zeros((0, 3)), np.zeros((0, 3)))


def hulls(boxes: Boxes) -> Boxes:
    """Fewer boxes that cover the same: those that touch are taken together."""
    found = []
    while len(boxes):
        hull, members = boxes[:1], boxes.meets(boxes[:1])
        while np.any(members):
            taken = joined([hull, boxes[members]])
            hull = Boxes(taken.low.min(axis=0)[np.newaxis], taken.high.max(axis=0)[np.newaxis])
            boxes = boxes[~members]
            members = boxes.meets(hull)
        found.append(hull)
    return joined([no_boxes(), *found])
