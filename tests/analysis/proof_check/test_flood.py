"""Protects the flood of the checker: it leaves out no neighbour of a box that is wet."""

from collections.abc import Callable, Iterable
from itertools import product

import numpy as np
import pytest
from support.proofs import leaves

from rbstab.analysis.proof_check import flood as module
from rbstab.analysis.proof_check.boxes import Box, width
from rbstab.analysis.proof_check.flood import APART, WALL, WET, Flood, Sides, Terrain, flood

UNIT: Box = ((0.0, 1.0), (0.0, 1.0), (0.0, 1.0))
Cell = tuple[int, ...]
SIDE = 4
"""Cells along an edge of the unit box; each is one box of a flood."""


def cell_of(box: Box) -> Cell:
    return tuple(int(SIDE * low) for low, _ in box)


def box_of(cell: Cell) -> Box:
    return tuple((k / SIDE, (k + 1) / SIDE) for k in cell)


def free(_: Box, __: Sides) -> str | None:
    return None


def flood_cells(
    wet: Iterable[Cell],
    start: Cell,
    obstacle: Callable[[Box, Sides], str | None] = free,
) -> tuple[Flood, set[Cell]]:
    """Flood the unit box, where some cells are wet; return the flood and the flooded cells."""
    cells, reached = set(wet), set[Cell]()

    def reason(box: Box) -> str | None:
        if width(box) > 1 / SIDE:
            return None
        return WET if cell_of(box) in cells else "dry"

    def seen(box: Box, sides: Sides) -> str | None:
        reached.add(cell_of(box))
        return obstacle(box, sides)

    # The inside of the first cell, so that only this cell touches it.
    inside: Box = tuple((low + 0.01, high - 0.01) for low, high in box_of(start))
    return flood(UNIT, inside, Terrain(reason, seen)), reached


@pytest.mark.parametrize("step", [s for s in product((-1, 0, 1), repeat=3) if any(s)], ids=str)
def test_a_flood_goes_on_over_faces_edges_and_corners(step: Cell) -> None:
    start = (1, 2, 1)
    other = tuple(k + d for k, d in zip(start, step, strict=True))
    found, reached = flood_cells([start, other], start)
    assert found.obstacle is None
    assert reached == {start, other}


def test_a_flood_does_not_jump() -> None:
    start = (0, 0, 0)
    wall = {cell for cell in product(range(SIDE), repeat=3) if sum(cell) in {4, 5, 6}}
    wet = set(product(range(SIDE), repeat=3)) - wall
    found, reached = flood_cells(wet, start)
    assert found.obstacle is None
    assert reached == {cell for cell in wet if sum(cell) < 4}
    # One layer of cells is passed over their corners.
    thin = {cell for cell in wall if sum(cell) == 4}
    _, reached = flood_cells(set(product(range(SIDE), repeat=3)) - thin, start)
    assert (3, 3, 3) in reached


def test_a_long_way_is_followed_to_its_end() -> None:
    way = [(k, 0, 0) for k in range(SIDE)] + [(3, k, 0) for k in range(SIDE)]
    way += [(3, 3, k) for k in range(SIDE)] + [(k, 3, 3) for k in range(SIDE)]
    _, reached = flood_cells(way, (0, 0, 0))
    assert reached == set(way)
    last = (0, 3, 3)
    found, _ = flood_cells(way, (0, 0, 0), lambda box, _: "end" if cell_of(box) == last else None)
    assert found.obstacle == "end"
    assert found.cover.open == box_of(last)


def test_the_tree_has_all_boxes() -> None:
    found, _ = flood_cells([(0, 0, 0), (1, 1, 1)], (0, 0, 0))
    listed = leaves(found.cover)
    assert sum(np.prod(box[:, 1] - box[:, 0]) for _, box in listed) == 1.0
    cells = {
        name: {cell_of(box.tolist()) for other, box in listed if other == name}
        for name, _ in listed
    }
    assert cells[WET] == {(0, 0, 0), (1, 1, 1)}
    # All neighbours of the wet cells are examined.
    assert set(product(range(3), repeat=3)) - cells[WET] <= cells["dry"]
    assert cells[APART]
    assert found.cover.boxes == sum(name != APART for name in found.cover.tree)


def test_the_limits_of_a_flood(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "BOX_LIMIT", 50)
    endless = flood(UNIT, UNIT, Terrain(lambda _: None, free))
    assert endless.obstacle == "too many boxes"
    assert endless.cover.boxes == 50
    monkeypatch.undo()
    # Along one way down the boxes become too narrow.
    point: Box = ((0.3, 0.3), (0.3, 0.3), (0.3, 0.3))
    narrow = flood(UNIT, point, Terrain(lambda _: None, free))
    assert narrow.obstacle == "too many boxes"
    assert narrow.cover.boxes < 200


def test_boxes_may_be_thinner_along_one_axis() -> None:
    """The tree of a stretched flood has the axes along which it was halved, as any other."""

    def reason(box: Box) -> str | None:
        low, high = box[1]
        return ("b" if low >= 0.25 else WET) if high - low <= 0.25 else None

    found = flood(UNIT, UNIT, Terrain(reason, free), stretch=100.0)
    assert set(found.cover.tree) == {"2", "b", WET}
    for _, part in leaves(found.cover):
        assert tuple(part[0]) == UNIT[0]
        assert tuple(part[2]) == UNIT[2]


PLANES = (0.375, 0.625)
"""Surfaces across the second layer of cells along x, and the third one along y."""


def sides_of(box: Box) -> Sides:
    """Return on which sides of the two planes a box is."""
    pairs = zip(PLANES, box, strict=False)
    ends = [(low - plane, high - plane) for plane, (low, high) in pairs]
    return tuple(
        frozenset(({-1} if low <= 0 else set()) | ({1} if high >= 0 else set()))
        for low, high in ends
    )


def flood_between(walls: dict[Cell, int]) -> set[tuple[Cell, Sides]]:
    """Flood all cells from the first one, where some have a wall; return what was flooded."""
    reached = set[tuple[Cell, Sides]]()

    def reason(box: Box) -> str | None:
        if width(box) > 1 / SIDE:
            return None
        number = walls.get(cell_of(box))
        return WET if number is None else f"{WALL}{number}"

    def seen(box: Box, sides: Sides) -> None:
        assert (cell_of(box), sides) not in reached
        reached.add((cell_of(box), sides))

    start: Box = ((0.01, 0.02), (0.01, 0.02), (0.01, 0.02))
    found = flood(UNIT, start, Terrain(reason, seen, sides_of))
    assert found.obstacle is None
    return reached


def test_a_wall_holds_a_flood_back() -> None:
    """A plane has a wall: what is beyond it stays dry, its own layer is flooded on one side."""
    layer = {cell: 1 for cell in product(range(SIDE), repeat=3) if cell[0] == 1}
    reached = flood_between(layer)
    assert {cell for cell, _ in reached} == {
        cell for cell in product(range(SIDE), repeat=3) if cell[0] <= 1
    }
    assert {sides[0] for _, sides in reached} == {frozenset({-1})}


@pytest.mark.parametrize("gap", [(1, 0, 0), (1, 3, 3), (1, 2, 1)])
def test_a_gap_in_a_wall_lets_a_flood_through(gap: Cell) -> None:
    layer = {cell: 1 for cell in product(range(SIDE), repeat=3) if cell[0] == 1 and cell != gap}
    reached = flood_between(layer)
    assert {cell for cell, _ in reached} == set(product(range(SIDE), repeat=3))
    # Both sides of the wall are flooded, each by itself.
    assert {sides[0] for cell, sides in reached if cell in layer} == {
        frozenset({-1}),
        frozenset({1}),
    }


def test_a_flood_goes_round_the_end_of_a_wall() -> None:
    """The second plane has a wall up to the layer of the first one, whose own walls leave a way."""
    walls = {cell: 1 for cell in product(range(SIDE), repeat=3) if cell[0] == 1}
    walls |= {cell: 2 for cell in product(range(SIDE), repeat=3) if cell[0] == 0 and cell[1] == 2}
    reached = flood_between(walls)
    assert {cell for cell, _ in reached} <= set(product(range(2), range(SIDE), range(SIDE)))
    # The cells with the wall of the first plane let it pass the second one.
    assert any(cell[1] == 3 for cell, _ in reached)
    assert all(frozenset({1}) != sides[0] for _, sides in reached)
