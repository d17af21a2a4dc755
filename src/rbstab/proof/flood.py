"""A flood over a tree of boxes: all that a component of {V < level} about a start may reach.

The range is divided into cells, and cells into eighths. A cell is dry if V >= level on it. W, the
component about the start, is open in the range. So it stays connected without the edges of cells,
where more than two of them meet, and passes from cell to cell through the inside of their common
faces: what it reaches are the cells joined to the start by faces, without dry ones. The flood holds
if none of these touches another rest state with V < level, or has V < level on an open face.

Then W has a positive distance from the open faces, and no other rest state. Moreover each point Θ
of a flooded cell with V(Θ) < level lies in W: its component is in flooded cells too, so V is least
in it at a rest state, and the only one there is that of W. (`Flooded.contains`.)
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.levels import Ranges
from rbstab.proof.search import Box, Boxes, joined

FIRST_DEPTH = 3
"""Cells are halved so often along the shortest side before the flood begins."""

DEEPEST = 17
"""Halvings after which a cell is left as it is: three places then fit in one whole number."""

MOST_ROOTS = 7
"""Cells along one side of the range, before they are halved."""

LIMIT = 16_000
"""Cells that are examined in one flood."""

FAR = 0.6
"""rad: a place that is farther away than this does not make cells smaller."""

AT_OBSTACLE = 0.02
"""rad: cells at an obstacle that may be reached are halved down to this."""

SHARES = (0.45, 0.2)
"""The sizes of cells that are neither dry nor wet, relative to their distance from high places."""


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
        """Return the eight parts of each."""
        corners = np.stack([x.ravel() for x in np.meshgrid(*[[0, 1]] * 3, indexing="ij")])
        place = (2 * self.place[:, None, :] + corners[:, :, None]).reshape(3, -1)
        return Cells(self.box, self.roots, np.tile(self.depth + 1, 8), place)

    def joined(self, other: "Cells") -> "Cells":
        """Return both."""
        depth = np.concatenate([self.depth, other.depth])
        place = np.concatenate([self.place, other.place], 1)
        return Cells(self.box, self.roots, depth, place)

    def find(self, depth: int, place: Array) -> Array:
        """Return which cell a place of some depth is, or lies in; -1 if none. Shape (places,)."""
        found = np.full(place.shape[1], -1)
        for d in np.unique(self.depth[self.depth <= depth]).tolist():
            mine = np.flatnonzero(self.depth == d)
            keys = self._keys(d, self.place[:, mine])
            order = np.argsort(keys)
            asked = self._keys(d, place >> (depth - d))
            at = np.minimum(np.searchsorted(keys, asked, sorter=order), len(mine) - 1)
            hit = keys[order[at]] == asked
            found = np.where(hit, mine[order[at]], found)
        outside = np.any((place < 0) | (place >= (self.roots << depth)[:, None]), axis=0)
        return np.where(outside, -1, found)

    def _keys(self, depth: int, place: Array) -> Array:
        shift = depth + MOST_ROOTS.bit_length()
        return (place[0] << (2 * shift)) | (place[1] << shift) | place[2]

    def neighbours(self) -> tuple[Array, Array]:
        """Return all pairs of cells with a common face; of each pair the smaller one is first."""
        one, two = [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)]
        for d in np.unique(self.depth).tolist():
            mine = np.flatnonzero(self.depth == d)
            for axis in range(3):
                for side in (-1, 1):
                    place = self.place[:, mine].copy()
                    place[axis] += side
                    other = self.find(d, place)
                    one.append(mine[other >= 0])
                    two.append(other[other >= 0])
        return np.concatenate(one), np.concatenate(two)

    def joined_to(self, start: Array) -> Array:
        """Return which cells are joined to some of them by faces."""
        return joined_to(self.neighbours(), start)


def joined_to(pairs: tuple[Array, Array], start: Array, some: Array | None = None) -> Array:
    """Return which cells are joined to those of a start by pairs of cells, of some cells alone."""
    from scipy.sparse import coo_array  # imported late: few commands make proofs
    from scipy.sparse.csgraph import connected_components

    some = np.ones(len(start), dtype=bool) if some is None else some
    kept = some[pairs[0]] & some[pairs[1]]
    one, two = pairs[0][kept], pairs[1][kept]
    graph = coo_array((np.ones(len(one)), (one, two)), shape=(len(some), len(some)))
    _, label = connected_components(graph, directed=False)
    return np.isin(label, label[start & some]) & some


class Outcome(Enum):
    """How a flood ended."""

    HOLDS = "it reaches neither another rest state nor an open face"
    LEAVES = "it reaches one of these, by cells that are below the level"
    LIMIT = "the limit on the number of cells was reached"


@dataclass(frozen=True, eq=False)
class Flooded:
    """A flood.

    Args:
        level: The level, J.
        outcome: How it ended.
        cells: What it reached.
        apart: Cells that it did not reach, and that are not dry.
        examined: The number of cells that were examined.
        states: The numbers of the rest states that it reached, by wet cells if it leaves.
        faces: The parts of open faces that it reached, as boxes, and their faces (axis, sign).
    """

    level: float
    outcome: Outcome
    cells: Cells
    apart: Boxes
    examined: int
    states: tuple[int, ...] = ()
    faces: tuple[tuple[int, int, Boxes], ...] = ()

    @property
    def holds(self) -> bool:
        """Whether the component about the start is proved to reach nothing else."""
        return self.outcome is Outcome.HOLDS

    def contains(self, lo: Array, hi: Array) -> Array:
        """Return which boxes of starts with less energy than the level are in the region, proved.

        Such a start is in no dry cell: it is in the region if it is in none of those apart.

        Args:
            lo: The lower corners, shape (3, starts), rad.
            hi: The upper corners.
        """
        cells, boxes = self.cells, self.cells.boxes
        low, high = cells.box.lo[:, None], cells.box.hi[:, None]
        found = np.full(lo.shape[1], self.holds)
        found &= np.all((lo >= low) & (lo <= hi) & (hi <= high), axis=0)
        mine = np.flatnonzero(found)
        if not len(mine):
            return found
        depth = int(cells.depth.max(initial=0))
        share = (0.5 * (lo + hi)[:, mine] - low) / (high - low)
        at = cells.find(depth, (share * (cells.roots << depth)[:, None]).astype(np.int64))
        # Most starts lie in one cell; only the others are compared with those apart.
        in_one = np.all((boxes.lo[:, at] <= lo[:, mine]) & (hi[:, mine] <= boxes.hi[:, at]), axis=0)
        for k in mine[(at < 0) | ~in_one]:
            found[k] = not self.apart.touch(Box(lo[:, k], hi[:, k])).any()
        return found


@dataclass(frozen=True, eq=False)
class Heights:
    """What is known of V over some cells.

    Args:
        low: Lower bounds, J.
        high: Upper bounds, J.
        ends: Lower bounds on the parts of open faces that a cell has; infinite without one.
    """

    low: Array
    high: Array
    ends: Array

    def __getitem__(self, some: Array) -> "Heights":
        return Heights(self.low[some], self.high[some], self.ends[some])

    def joined(self, other: "Heights") -> "Heights":
        """Return both."""
        return Heights(
            np.concatenate([self.low, other.low]),
            np.concatenate([self.high, other.high]),
            np.concatenate([self.ends, other.ends]),
        )


class Land:
    """V over a range, and over the cells with which each flood begins.

    Args:
        ranges: V.
        box: The range; the doubles at its ends are not inside the exact one.
        open_axes: The axes of whose ends nothing keeps a motion away.
    """

    def __init__(self, ranges: Ranges, box: Box, open_axes: Collection[int]) -> None:
        self.ranges, self.box, self.open_axes = ranges, box, sorted(open_axes)
        self.cells = Cells.of(box)
        self.heights = self.over(self.cells)

    def over(self, cells: Cells) -> Heights:
        """Return bounds on V over cells, and over their parts of open faces."""
        boxes, n = cells.boxes, cells.count
        at_ends = self.faces(boxes)
        found = self.ranges.values(joined([boxes, *(one[-1] for one in at_ends)], 3))
        ends, begin = np.full(n, np.inf), n
        for _, _, mine, parts in at_ends:
            low = found.lo[begin : begin + parts.count]
            ends[mine] = np.minimum(ends[mine], low)
            begin += parts.count
        return Heights(found.lo[:n], found.hi[:n], ends)

    def faces(self, boxes: Boxes) -> list[tuple[int, int, Array, Boxes]]:
        """Return the parts of open faces that boxes have: axis, sign, which boxes, and the parts.

        π and π/2 are no doubles, so a face is as thick as one.
        """
        found = []
        for axis in self.open_axes:
            for sign, end in ((-1, self.box.lo[axis]), (1, self.box.hi[axis])):
                mine = (boxes.lo if sign < 0 else boxes.hi)[axis] == end
                if mine.any():
                    part = boxes[mine]
                    lo, hi = part.lo.copy(), part.hi.copy()
                    inner = np.nextafter(end, -sign * np.inf)
                    lo[axis], hi[axis] = min(end, inner), max(end, inner)
                    found.append((axis, sign, np.flatnonzero(mine), Boxes(lo, hi)))
        return found


def touched(places: Sequence[Box], boxes: Boxes) -> Array:
    """Return which places each box touches, shape (places, boxes)."""
    found = [boxes.touch(place) for place in places]
    return np.array(found, dtype=bool).reshape(len(places), boxes.count)


def flood(  # noqa: PLR0913, PLR0917 (each is one fact about the flood)
    land: Land,
    start: Box,
    level: float,
    low: Sequence[Box] = (),
    high: Array | None = None,
    limit: int = LIMIT,
) -> Flooded:
    """Flood a range from a start below a level.

    Cells whose values may be on both sides of the level are divided, down to a share of their
    distance from high places, until nothing else is reached, or until it is reached by wet cells.

    Args:
        land: V and the range.
        start: The enclosure of a minimum with V < level.
        level: The level, J.
        low: The enclosures of other rest states that are not proved to have V >= level.
        high: Points near which V is close to the level, such as passes, shape (3, points).
        limit: The number of cells that are examined.
    """
    cells, heights, examined, shares = land.cells, land.heights, 0, list(SHARES)
    apart = list[Boxes]()
    high = np.zeros((3, 0)) if high is None else high
    while True:
        kept = heights.low < level
        cells, heights = cells[kept], heights[kept]
        pairs = cells.neighbours()
        boxes, wet = cells.boxes, heights.high < level
        reached = joined_to(pairs, boxes.touch(start))
        states = touched(low, boxes)
        at_end = heights.ends < level
        bad = reached & (states.any(axis=0) | at_end)
        apart.append(boxes[~reached])
        if not bad.any():
            return Flooded(level, Outcome.HOLDS, cells[reached], joined(apart, 3), examined)
        surely = joined_to(pairs, boxes.touch(start), wet) & bad
        width = (boxes.hi - boxes.lo).max(axis=0)
        open_ = reached & ~wet & (cells.depth < DEEPEST)
        gap = _gap(boxes, high)
        # At an obstacle that may be reached, cells are as small as it needs.
        split = open_ & ((width > shares[0] * gap) | (bad & (width > AT_OBSTACLE)))
        while not split.any() and len(shares) > 1:
            shares.pop(0)
            split = open_ & (width > shares[0] * gap)
        if surely.any() or not split.any() or examined >= limit:
            outcome = Outcome.LEAVES if surely.any() else Outcome.LIMIT
            which = np.flatnonzero(states[:, surely if surely.any() else reached].any(axis=1))
            parts = land.faces(boxes[reached & at_end])
            faces = tuple((axis, sign, part) for axis, sign, _, part in parts)
            reached_states = tuple(which.tolist())
            none = joined([], 3)
            return Flooded(level, outcome, cells[reached], none, examined, reached_states, faces)
        parts_of = cells[split].eighths()
        examined += parts_of.count
        left = reached & ~split
        cells, heights = cells[left].joined(parts_of), heights[left].joined(land.over(parts_of))


def _gap(boxes: Boxes, points: Array) -> Array:
    """Return the distance of boxes from the nearest of some points, at most `FAR`."""
    found = np.full(boxes.count, FAR)
    for x in points.T:
        away = np.maximum(boxes.lo - x[:, None], x[:, None] - boxes.hi).max(axis=0)
        found = np.minimum(found, np.maximum(away, 0.0))
    return found
