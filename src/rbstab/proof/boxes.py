"""Boxes of angles and other variables, and many of them at once."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array


class Box(NamedTuple):
    """A box from lo to hi, both of shape (n,)."""

    lo: Array
    hi: Array

    def contains(self, x: Array) -> bool:
        """Return whether a point lies in it."""
        return bool(np.all((x >= self.lo) & (x <= self.hi)))


@dataclass(frozen=True, eq=False)
class Boxes:
    """Boxes from lo to hi, both of shape (n, boxes)."""

    lo: Array
    hi: Array

    def __iter__(self) -> Iterator[Array]:
        """Yield lo and hi."""
        return iter((self.lo, self.hi))

    @property
    def count(self) -> int:
        """Their number."""
        return int(self.lo.shape[1])

    def __getitem__(self, place: Array | slice) -> "Boxes":
        """Return some of them."""
        return Boxes(self.lo[:, place], self.hi[:, place])

    def within(self, outer: Box) -> Array:
        """Return which of them lie in a box."""
        return np.asarray(
            np.all((self.lo >= outer.lo[:, None]) & (self.hi <= outer.hi[:, None]), axis=0)
        )

    def touch(self, other: Box) -> Array:
        """Return which of them have a point in common with a box."""
        return np.asarray(
            np.all((self.lo <= other.hi[:, None]) & (self.hi >= other.lo[:, None]), axis=0)
        )

    def halved(self, axis: Array | None = None) -> "Boxes":
        """Return both halves of each, along its axis; by default along the widest."""
        axis = (self.hi - self.lo).argmax(axis=0) if axis is None else axis
        columns = np.arange(self.count)
        middle = 0.5 * self.lo[axis, columns] + 0.5 * self.hi[axis, columns]
        below, above = self.hi.copy(), self.lo.copy()
        below[axis, columns] = above[axis, columns] = middle
        return joined([Boxes(self.lo, below), Boxes(above, self.hi)], len(self.lo))


def joined(parts: Sequence[Boxes], n: int) -> Boxes:
    """Return the boxes of all parts, of n axes."""
    none = np.zeros((n, 0))
    return Boxes(
        np.concatenate([none, *(part.lo for part in parts)], 1),
        np.concatenate([none, *(part.hi for part in parts)], 1),
    )


def hulls(boxes: Boxes) -> Boxes:
    """Merge boxes that touch into their hulls, which cover all of them."""
    merged, n = list[Boxes](), len(boxes.lo)
    while boxes.count:
        low, high, boxes = boxes.lo[:, 0], boxes.hi[:, 0], boxes[slice(1, None)]
        while (near := boxes.touch(Box(low, high))).any():
            low = np.minimum(low, boxes.lo[:, near].min(axis=1))
            high = np.maximum(high, boxes.hi[:, near].max(axis=1))
            boxes = boxes[~near]
        merged.append(as_boxes(Box(low, high)))
    return joined(merged, n)


def as_boxes(box: Box) -> Boxes:
    """Return one box as boxes."""
    return Boxes(box.lo[:, None].astype(float), box.hi[:, None].astype(float))
