"""The pass of each minimum: the level at which the component of {V < level} about it meets others.

The range is filled with cells, each with bounds low <= V <= high. W, the component of {V < level}
about a minimum, is open in the range. So it stays connected without the edges of cells, where more
than two of them meet, and passes from cell to cell through the inside of their common faces. It
is in no cell with low >= level. So it is in the cells with low < level that are joined to the
minimum by such faces. If none of these touches another rest state with V < level, or has V < level
on an open face, W has a positive distance from the open faces, and no other rest state. Moreover
each point Θ of these cells with V(Θ) < level lies in W: its component is in these cells too, so V
is least in it at a rest state, and the only one there is that of W.

This is a graph. Its nodes are the cells, the rest states and the open faces; the weight of an edge
is the largest lower bound of V on both. The pass of a minimum is proved to be at least as high as
the weight at which its component, with edges in the order of their weights, meets another rest
state or an open face (`Complex.passes`). It is sharp if the cells are small on all ways over
passes: those that may be below and above a level are divided as long as they are on a shortest way
from the minimum to something else (`Complex.ways`).
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box, Boxes, joined
from rbstab.proof.enclosures.levels import Ranges
from rbstab.proof.regions.cells import DEEPEST, Cells

WET = 1e-7
"""The length of a cell below the level, if one that may be above it too has the length 1."""

HALF = 0.5
"""A way that is shorter has no cell of the length 1."""

NOBODY, SEVERAL = -1, -2
"""Instead of the number of the only rest state in a component; one past them is the border."""


class Pass(NamedTuple):
    """The end of the component about a minimum: its level, J, and the edge of the graph there."""

    level: float
    edge: tuple[int, int]


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

    def of_parts(self, parts: "Heights") -> "Heights":
        """Return bounds over the eighths of these cells, which are not worse than over all."""
        return Heights(
            np.maximum(parts.low, np.tile(self.low, 8)),
            np.minimum(parts.high, np.tile(self.high, 8)),
            np.maximum(parts.ends, np.tile(self.ends, 8)),
        )


Face = tuple[int, int]
"""An axis and the sign of its angle."""


class Parts(NamedTuple):
    """The parts of a face of a range that some boxes have: the face, which boxes, and the parts."""

    face: Face
    places: Array
    boxes: Boxes


def parts_of(box: Box, axes: Sequence[int], boxes: Boxes) -> Iterator[Parts]:
    """Yield the parts of faces that boxes have, as thick as one double: π and π/2 are none.

    Args:
        box: The range.
        axes: The axes of the faces.
        boxes: Boxes in the range.
    """
    for axis in axes:
        for sign, end in ((-1, box.lo[axis]), (1, box.hi[axis])):
            mine = np.flatnonzero((boxes.lo if sign < 0 else boxes.hi)[axis] == end)
            lo, hi = boxes.lo[:, mine], boxes.hi[:, mine]
            inner = np.nextafter(end, -sign * np.inf)
            lo[axis], hi[axis] = min(end, inner), max(end, inner)
            yield Parts((axis, sign), mine, Boxes(lo, hi))


class Land:
    """V over a range with its rest states.

    Args:
        ranges: V.
        box: The range; the doubles at its ends are not inside the exact one.
        open_axes: The axes of whose ends nothing keeps a motion away.
        states: The enclosures of the rest states.
        bottoms: Lower bounds of V in these, shape (states,), J.
    """

    def __init__(
        self,
        ranges: Ranges,
        box: Box,
        open_axes: Collection[int],
        states: Sequence[Box],
        bottoms: Array,
    ) -> None:
        self.ranges, self.box, self.open_axes = ranges, box, sorted(open_axes)
        self.states, self.bottoms = list(states), bottoms

    def over(self, cells: Cells) -> Heights:
        """Return bounds on V over cells, and over their parts of open faces."""
        boxes, n = cells.boxes, cells.count
        at_ends = self.faces(boxes)
        found = self.ranges.values(joined([boxes, *(one.boxes for one in at_ends)], 3))
        ends, begin = np.full(n, np.inf), n
        for one in at_ends:
            low = found.lo[begin : begin + one.boxes.count]
            ends[one.places] = np.minimum(ends[one.places], low)
            begin += one.boxes.count
        return Heights(found.lo[:n], found.hi[:n], ends)

    def faces(self, boxes: Boxes) -> "list[Parts]":
        """Return the parts of open faces that boxes have."""
        return [part for part in parts_of(self.box, self.open_axes, boxes) if part.boxes.count]

    def touching(self, boxes: Boxes) -> tuple[Array, Array]:
        """Return the pairs of a box and a rest state whose enclosure it touches."""
        found = np.array([boxes.touch(state) for state in self.states], dtype=bool)
        state, box = np.nonzero(found.reshape(len(self.states), boxes.count))
        return box, state


class Complex:
    """Cells that fill a range, as a graph.

    Args:
        land: V.
        cells: The cells.
        heights: Bounds on V over them.
        pairs: The pairs of cells with a common face.
        touching: The pairs of a cell and a rest state.
    """

    def __init__(
        self,
        land: Land,
        cells: Cells,
        heights: Heights,
        pairs: tuple[Array, Array],
        touching: tuple[Array, Array],
    ) -> None:
        self.land, self.cells, self.heights = land, cells, heights
        self.pairs, self.touching = pairs, touching

    @classmethod
    def of(cls, land: Land) -> "Complex":
        """Return the cells at first."""
        cells = Cells.of(land.box)
        touching = land.touching(cells.boxes)
        return cls(land, cells, land.over(cells), cells.neighbours(), touching)

    @property
    def count(self) -> int:
        """The number of cells."""
        return self.cells.count

    def place(self, edge: tuple[int, int]) -> Box:
        """Return where an edge is: the rest state, or the one of its cells with the larger V."""
        states = [k - self.count for k in edge if self.count <= k < self.border]
        if states:
            return self.land.states[states[0]]
        cell = max((k for k in edge if k < self.count), key=lambda k: float(self.heights.low[k]))
        lo, hi = self.cells[np.array([cell])].boxes
        return Box(lo[:, 0], hi[:, 0])

    @property
    def border(self) -> int:
        """The number of the node of all open faces: it is the last one."""
        return self.cells.count + len(self.land.states)

    def divided(self, some: Array) -> "Complex":
        """Return the complex with some cells in eighths; the others come first."""
        n, split = self.cells.count, np.zeros(self.cells.count, dtype=bool)
        split[some] = True
        parts = self.cells[split].eighths()
        cells = self.cells[~split].joined(parts)
        heights = self.heights[~split].joined(self.heights[split].of_parts(self.land.over(parts)))
        number, m = np.cumsum(~split) - 1, n - int(split.sum())
        one, two = self.pairs
        kept = ~split[one] & ~split[two]
        beside = np.concatenate([one[~kept], two[~kept]])
        beside = np.unique(number[beside[~split[beside]]])
        first, second = cells.neighbours(np.concatenate([beside, np.arange(m, cells.count)]))
        new = second >= m
        pairs = (
            np.concatenate([number[one[kept]], first[new]]),
            np.concatenate([number[two[kept]], second[new]]),
        )
        cell, state = self.touching
        left = ~split[cell]
        other, at = self.land.touching(parts.boxes)
        touching = (
            np.concatenate([number[cell[left]], m + other]),
            np.concatenate([state[left], at]),
        )
        return Complex(self.land, cells, heights, pairs, touching)

    def edges(self, level: float) -> tuple[Array, Array, Array]:
        """Return the edges with a weight below a level: both nodes of each, and the weight."""
        low, ends, n = self.heights.low, self.heights.ends, self.cells.count
        (one, two), (cell, state) = self.pairs, self.touching
        at_end = np.flatnonzero(ends < level)
        weight = np.concatenate(
            [
                np.maximum(low[one], low[two]),
                np.maximum(low[cell], self.land.bottoms[state]),
                np.maximum(low[at_end], ends[at_end]),
            ]
        )
        one = np.concatenate([one, cell, at_end])
        two = np.concatenate([two, n + state, np.full(len(at_end), self.border)])
        below = weight < level
        return one[below], two[below], weight[below]

    def passes(self, minima: Sequence[int], cap: float = np.inf) -> list[Pass | None]:
        """Return the proved pass of each of some rest states.

        Args:
            minima: The numbers of the rest states.
            cap: The level at which all end; they have no pass if they meet nothing below.
        """
        from scipy.sparse.csgraph import minimum_spanning_tree  # imported late, as in `_graph`

        one, two, weight = self.edges(cap)
        n, nodes = self.cells.count, self.border + 1
        _, rank = np.unique(weight, return_inverse=True)
        tree = minimum_spanning_tree(_graph(rank + 1.0, one, two, nodes)).tocoo()
        order = np.argsort(tree.data, kind="stable")
        value = np.unique(weight)[tree.data.astype(np.int64) - 1] if len(weight) else weight
        root, owner = list(range(nodes)), [NOBODY] * n + list(range(nodes - n))
        found: dict[int, Pass] = {}
        ends = tree.row[order].tolist(), tree.col[order].tolist(), value[order].tolist()
        for a, b, level in zip(*ends, strict=True):
            i, j = _root(root, a), _root(root, b)
            if NOBODY in (owner[i], owner[j]):
                owner[j] = max(owner[i], owner[j], key=lambda k: k != NOBODY)
            else:
                found |= {k: Pass(level, (a, b)) for k in (owner[i], owner[j]) if k != SEVERAL}
                owner[j] = SEVERAL
                if all(k in found for k in minima):
                    break
            root[i] = j
        return [found.get(k) for k in minima]

    def ways(self, minimum: int, level: float) -> "Ways":
        """Return where the component of a minimum may leave below a level."""
        from scipy.sparse.csgraph import dijkstra  # imported late, as in `_graph`

        low_enough, n = self.heights.high < level, self.cells.count
        one, two, _ = self.edges(level)
        length = np.where(low_enough | (self.cells.depth == DEEPEST), WET, 1.0)
        inner, mine = two < n, two == n + minimum
        start, end = one[mine], np.unique(one[~inner & ~mine])
        one, two = one[inner], two[inner]
        # Two more nodes are the start and the end of all ways; a way is as long as its cells.
        begins, stops = np.full(len(start), n), np.full(len(end), n + 1)
        rows = np.concatenate([one, two, begins, stops])
        columns = np.concatenate([two, one, start, end])
        graph = _graph(length[columns], rows, columns, n + 2)
        here, there = dijkstra(graph, indices=[n, n + 1])[:, :n]
        shortest = here[end].min(initial=np.inf)
        if shortest < HALF:
            sure = end[(here[end] < HALF) & (self.heights.ends[end] < level)]
            return Ways(np.zeros(0, dtype=int), sure, leaves=True)
        on_one = (length == 1) & (here + there - length < shortest + HALF)
        open_ = np.flatnonzero(on_one & (shortest < np.inf))
        return Ways(open_, np.zeros(0, dtype=int), leaves=False)

    def component(self, minimum: int, level: float) -> "Component":
        """Return what the component of a minimum may reach below a level."""
        from scipy.sparse.csgraph import connected_components  # imported late, as in `_graph`

        n, (one, two, _) = self.cells.count, self.edges(level)
        graph = _graph(np.ones(len(one)), one, two, self.border + 1)
        _, label = connected_components(graph, directed=False)
        mine = label == label[n + minimum]
        alone = int(mine[n:].sum()) == 1 and bool(mine[:n].any())
        return Component(self.cells, alone, ~mine[:n] & (self.heights.low < level))


class Ways(NamedTuple):
    """Where the component of a minimum may leave below a level.

    Attributes:
        open: The cells that may have V on both sides of the level, and are on a shortest way from
            the minimum to another rest state or an open face; none if no way is left.
        outlets: The cells with parts of open faces to which cells below the level lead.
        leaves: Whether such cells lead anywhere, for all that is known.
    """

    open: Array
    outlets: Array
    leaves: bool


@dataclass(frozen=True, eq=False)
class Component:
    """The component of {V < level} about a minimum.

    Args:
        cells: Cells that fill the range.
        holds: Whether it is proved to reach no other rest state, and no open face.
        apart: Which cells it does not reach, although V < level is possible there.
    """

    cells: Cells
    holds: bool
    apart: Array

    def contains(self, lo: Array, hi: Array) -> Array:
        """Return which boxes of starts with less energy than the level are in it, proved.

        Such a start is not where V >= level: it is in the component if it is in no cell apart.

        Args:
            lo: The lower corners, shape (3, starts), rad.
            hi: The upper corners.
        """
        cells, boxes = self.cells, self.cells.boxes
        low, high = cells.box.lo[:, None], cells.box.hi[:, None]
        found = np.full(lo.shape[1], self.holds)
        found &= np.all((lo >= low) & (lo <= hi) & (hi <= high), axis=0)
        mine = np.flatnonzero(found)
        ends = np.stack([lo[:, mine], hi[:, mine]])
        most = (cells.roots << DEEPEST)[:, None]
        place = np.minimum(((ends - low) / (high - low) * most).astype(np.int64), most - 1)
        # A box in at most two of the smallest cells along each axis is in the cells of its corners.
        narrow = np.all(place[1] - place[0] <= 1, axis=0)
        for corner in product((0, 1), repeat=3):
            x, p = (np.stack([one[c, k] for k, c in enumerate(corner)]) for one in (ends, place))
            at = cells.find(p)
            narrow &= np.all((boxes.lo[:, at] <= x) & (x <= boxes.hi[:, at]), axis=0)
            found[mine] &= ~self.apart[at] | ~narrow
        for k in mine[~narrow]:
            found[k] = not boxes[self.apart].touch(Box(lo[:, k], hi[:, k])).any()
        return found


def _graph(lengths: Array, one: Array, two: Array, nodes: int) -> Any:
    from scipy.sparse import coo_array  # imported late: few commands make proofs

    return coo_array((lengths, (one, two)), shape=(nodes, nodes)).tocsr()


def _root(root: list[int], k: int) -> int:
    while root[k] != k:
        root[k] = root[root[k]]
        k = root[k]
    return k
