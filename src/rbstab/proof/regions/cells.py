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
is the largest lower bound of V on both. A flood from a minimum takes the lowest edges first. The
highest that it has taken when it meets another rest state or an open face is a proved lower bound
of the pass (`Cells.flood`). It is sharp if the cells are small on all ways over passes: those that
may be below and above a level are divided as long as they are on a shortest way from the minimum to
something else (`Cells.ways`).
"""

from dataclasses import dataclass
from functools import cached_property
from heapq import heappop, heappush
from typing import Any, NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box, Boxes, joined
from rbstab.proof.regions.landscape import Landscape

LIMIT = 32_000
"""Cells of one range."""

AT_ONCE = 300
"""Cells that are divided at once, the largest first: others may then be on no way any more."""

MOST_ALONG = 7
"""Cells along a side of the range are not narrower than twice so many would be."""

DEEPEST = 17
"""Divisions after which a cell is left as it is."""

WET = 1e-7
"""The length of a cell below the level, if one that may be above it too has the length 1."""

HALF = 0.5
"""A way that is shorter has no cell of the length 1."""


class Pass(NamedTuple):
    """The end of the component about a minimum: its level, J, and the edge of the graph there."""

    level: float
    edge: tuple[int, int]


class Flood(NamedTuple):
    """What a flood from a minimum has reached below a level.

    Attributes:
        end: The proved pass; None if it met no other rest state and no open face below the level.
        cells: The cells that it reached before.
    """

    end: Pass | None
    cells: set[int]


class Ways(NamedTuple):
    """Where the component of a minimum may leave below a level.

    Attributes:
        open: The cells that may have V on both sides of the level, and are on a shortest way from
            the minimum to another rest state or an open face; none if no way is left, or if there
            are `ends`.
        ends: The cells beside another rest state or an open face to which cells below the level
            lead.
    """

    open: Array
    ends: Array


@dataclass(frozen=True, eq=False)
class Cells:
    """Boxes that fill a range, as a graph.

    Args:
        land: V.
        boxes: The cells.
        depth: How often each was divided.
        bounds: Those of `Landscape.bounds`.
        pairs: The pairs of cells with a common face, shape (2, pairs).
        touching: Which cells touch which rest state, shape (states, cells).
    """

    land: Landscape
    boxes: Boxes
    depth: Array
    bounds: Array
    pairs: Array
    touching: Array

    @classmethod
    def of(cls, land: Landscape) -> "Cells":
        """Return the cells at first: near cubes."""
        width = land.box.hi - land.box.lo
        along = 2 * np.clip(np.rint(width / width.min()), 1, MOST_ALONG).astype(int)
        lines = [np.linspace(a, b, n + 1) for a, b, n in zip(*land.box, along, strict=True)]
        lo, hi = (
            np.stack([x.ravel() for x in np.meshgrid(*(x[part] for x in lines), indexing="ij")])
            for part in (slice(None, -1), slice(1, None))
        )
        boxes = Boxes(lo, hi)
        pairs = np.stack(np.triu_indices(boxes.count, 1))
        pairs = pairs[:, _beside(boxes, pairs)]
        depth = np.zeros(boxes.count, dtype=int)
        return cls(land, boxes, depth, land.bounds(boxes), pairs, land.touching(boxes))

    @property
    def low(self) -> Array:
        """Lower bounds of V, J."""
        return self.bounds[0]

    @property
    def high(self) -> Array:
        """Upper bounds of V, J."""
        return -self.bounds[1]

    @property
    def ends(self) -> Array:
        """Lower bounds of V on the parts of open faces, J; infinite without one."""
        return self.bounds[2]

    @property
    def count(self) -> int:
        """Their number."""
        return self.boxes.count

    @property
    def border(self) -> int:
        """The number of the node of all open faces; those of rest states are before it."""
        return self.count + len(self.land.states)

    def place(self, edge: tuple[int, int]) -> Box:
        """Return where an edge is: the rest state, or the one of its cells with the larger V."""
        states = [k - self.count for k in edge if self.count <= k < self.border]
        if states:
            return self.land.states[states[0]]
        cell = max((k for k in edge if k < self.count), key=lambda k: float(self.low[k]))
        return Box(self.boxes.lo[:, cell], self.boxes.hi[:, cell])

    def divided(self, some: Array) -> "Cells":
        """Return the cells with the largest of some of them in eighths; the others come first."""
        some = some[np.argsort(self.depth[some], kind="stable")][:AT_ONCE]
        split = np.zeros(self.count, dtype=bool)
        split[some] = True
        boxes, pairs, left = self.boxes, self.pairs, split
        for axis in range(3):
            boxes, pairs = _halved(boxes, pairs, left, axis)
            left = np.arange(boxes.count) >= self.count - len(some)
        parts = boxes[left]
        # V over a part is not known worse than over the whole.
        bounds = np.maximum(np.tile(self.bounds[:, split], 8), self.land.bounds(parts))
        return Cells(
            self.land,
            boxes,
            np.concatenate([self.depth[~split], np.tile(self.depth[split] + 1, 8)]),
            np.concatenate([self.bounds[:, ~split], bounds], 1),
            pairs,
            np.concatenate([self.touching[:, ~split], self.land.touching(parts)], 1),
        )

    def _edges(self, level: float) -> tuple[Array, Array, Array]:
        """Return the edges with a weight below a level: both nodes of each, and the weight."""
        (first, second), (state, cell) = self.pairs, np.nonzero(self.touching)
        low, at_end = self.low, np.flatnonzero(self.ends < level)
        weight = np.concatenate(
            [
                np.maximum(low[first], low[second]),
                np.maximum(low[cell], self.land.at_zeros.lo[state]),
                np.maximum(low[at_end], self.ends[at_end]),
            ]
        )
        first = np.concatenate([first, cell, at_end])
        second = np.concatenate([second, self.count + state, np.full(len(at_end), self.border)])
        below = weight < level
        return first[below], second[below], weight[below]

    @cached_property
    def _links(self) -> tuple[list[int], list[int], list[float]]:
        """The edges in rows, one for each node: where it begins, the other nodes, the weights."""
        first, second, weight = self._edges(np.inf)
        both = np.concatenate([first, second]), np.concatenate([second, first])
        graph = _graph(np.tile(weight, 2), *both, self.border + 1)
        return graph.indptr.tolist(), graph.indices.tolist(), graph.data.tolist()

    def flood(self, minimum: int, level: float = np.inf) -> Flood:
        """Flood from a rest state until another one or an open face is met, or up to a level."""
        begin, to, weights = self._links
        start, top = self.count + minimum, Pass(-np.inf, (0, 0))
        reached, seen = [(-np.inf, start, start)], set[int]()
        while reached:
            height, before, node = heappop(reached)
            if height >= level:
                break
            if node in seen:
                continue
            if height > top.level:
                top = Pass(height, (before, node))
            if node >= self.count and node != start:
                return Flood(top, seen)
            seen.add(node)
            for k in range(begin[node], begin[node + 1]):
                if to[k] not in seen:
                    heappush(reached, (weights[k], node, to[k]))
        return Flood(None, seen)

    def ways(self, minimum: int, level: float) -> Ways:
        """Return where the component of a minimum may leave below a level."""
        from scipy.sparse.csgraph import dijkstra  # imported late, as in `_graph`

        n, (first, second, _) = self.count, self._edges(level)
        length = np.where((self.high < level) | (self.depth == DEEPEST), WET, 1.0)
        inner, at_minimum = second < n, second == n + minimum
        start, end = first[at_minimum], np.unique(first[~inner & ~at_minimum])
        first, second = first[inner], second[inner]
        # Two more nodes are the start and the end of all ways; a way is as long as its cells.
        begins, stops = np.full(len(start), n), np.full(len(end), n + 1)
        rows = np.concatenate([first, second, begins, stops])
        columns = np.concatenate([second, first, start, end])
        graph = _graph(length[columns], rows, columns, n + 2)
        here, there = dijkstra(graph, indices=[n, n + 1])[:, :n]
        shortest, none = here[end].min(initial=np.inf), np.zeros(0, dtype=int)
        if shortest < HALF:
            return Ways(none, end[here[end] < HALF])
        on_way = (length == 1) & (here + there - length < shortest + HALF)
        return Ways(np.flatnonzero(on_way & (shortest < np.inf)), none)

    def up_to(self, minimum: int, level: float) -> "Cells":
        """Return cells that prove a level of a minimum, if `LIMIT` is enough for it."""
        cells = self
        while cells.count < LIMIT and len(some := cells.ways(minimum, level).open):
            cells = cells.divided(some)
        return cells

    def component(self, minimum: int, level: float) -> "Component":
        """Return what the component of a minimum may reach below a level."""
        flood = self.flood(minimum, level)
        apart = self.low < level
        apart[[k for k in flood.cells if k < self.count]] = False
        holds = flood.end is None and len(flood.cells) > 1
        return Component(self.land.box, holds, self.boxes[apart])


@dataclass(frozen=True, eq=False)
class Component:
    """The component of {V < level} about a minimum.

    Args:
        box: The range.
        holds: Whether it is proved to reach no other rest state, and no open face.
        apart: Cells that it does not reach, although V < level is possible there.
    """

    box: Box
    holds: bool
    apart: Boxes

    def contains(self, start: Box) -> bool:
        """Return whether starts with less energy than the level, and Θ in a box, are in it.

        Such a start is not where V >= level: it is in the component if it is in no cell apart.
        """
        inside = np.all((self.box.lo <= start.lo) & (start.lo <= start.hi))
        inside &= np.all(start.hi <= self.box.hi)
        return self.holds and bool(inside) and not self.apart.touch(start).any()


def _halved(boxes: Boxes, pairs: Array, split: Array, axis: int) -> tuple[Boxes, Array]:
    """Return boxes with some of them halved along an axis, and the new pairs of neighbours."""
    parts = boxes[split]
    # Those that are not halved come first, then the lower halves, then the upper ones.
    halves = joined([boxes[~split], parts.halved(np.full(parts.count, axis))], 3)
    kept, m = boxes.count - parts.count, parts.count
    # The new numbers of each box: two of one that is halved.
    numbers = np.full((2, boxes.count), -1)
    numbers[0, ~split] = np.arange(kept)
    numbers[:, split] = kept + np.arange(2 * m).reshape(2, m)
    cell, neighbour = pairs
    changed = split[cell] | split[neighbour]
    first = numbers[:, None, cell[changed]]
    second = numbers[None, :, neighbour[changed]]
    new = np.stack([x.ravel() for x in np.broadcast_arrays(first, second)])
    new = new[:, np.all(new >= 0, axis=0)]
    new = new[:, _beside(halves, new)]
    return halves, np.concatenate([numbers[0, pairs[:, ~changed]], new, numbers[:, split]], 1)


def _beside(boxes: Boxes, pairs: Array) -> Array:
    """Return which pairs of boxes, of which none overlap, have a face in common."""
    first, second = pairs
    size = np.minimum(boxes.hi[:, first], boxes.hi[:, second])
    size -= np.maximum(boxes.lo[:, first], boxes.lo[:, second])
    return np.asarray(np.all(size >= 0, axis=0) & (np.sum(size > 0, axis=0) == 2))


def _graph(lengths: Array, rows: Array, columns: Array, nodes: int) -> Any:
    from scipy.sparse import coo_array  # imported late: few commands make proofs

    return coo_array((lengths, (rows, columns)), shape=(nodes, nodes)).tocsr()
