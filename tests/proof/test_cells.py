"""Cells of a range: their neighbours and the cells of places, by comparing all corners."""

import numpy as np

from rbstab.proof.boxes import Box
from rbstab.proof.regions.cells import DEEPEST, Cells

END = np.array([np.nextafter(np.pi, 4), np.nextafter(np.pi / 2, 2), np.nextafter(np.pi, 4)])
RANGE = Box(-END, END)


def cells_of_many_depths(rounds=3, depth=1):
    """Return cells of a range, of which some are divided, and some of these again."""
    cells, rng = Cells.of(RANGE, depth), np.random.default_rng(1)
    for _ in range(rounds):
        split = rng.random(cells.count) < 0.15
        cells = cells[~split].joined(cells[split].eighths())
    return cells


def pairs_of(found):
    """Return pairs of numbers as a list of sets."""
    return [frozenset(pair) for pair in zip(*(one.tolist() for one in found), strict=True)]


def pairs_by_corners(cells):
    """Return the pairs of cells whose common part is a face."""
    (lo, hi), found = cells.boxes, set()
    for k in range(cells.count):
        size = np.minimum(hi, hi[:, [k]]) - np.maximum(lo, lo[:, [k]])
        touching = ((size == 0).sum(axis=0) == 1) & ((size > 0).sum(axis=0) == 2)
        found |= {frozenset((k, j)) for j in np.flatnonzero(touching).tolist()}
    return found


def test_cells_of_all_depths_have_their_neighbours():
    """Each pair once."""
    cells = cells_of_many_depths()
    pairs, expected = pairs_of(cells.neighbours()), pairs_by_corners(cells)
    assert len(pairs) == len(set(pairs))
    assert set(pairs) == expected
    # Of some cells: those that are not smaller are found.
    depth = cells.depth
    of_some = {p for p in expected if any(k % 3 == 0 and depth[k] == max(depth[[*p]]) for k in p)}
    assert set(pairs_of(cells.neighbours(np.arange(0, cells.count, 3)))) == of_some


def test_the_cell_of_a_place_is_found():
    """Random places of the smallest cells, and of those at the ends of the range."""
    cells = cells_of_many_depths()
    lo, hi = cells.boxes
    most = (cells.roots << DEEPEST)[:, None]
    rng = np.random.default_rng(2)
    place = rng.integers(0, most, size=(3, 500))
    place[:, :2] = np.hstack([np.zeros_like(most), most - 1])
    at = cells.find(place)
    middle = -END[:, None] + 2 * END[:, None] * (place + 0.5) / most
    assert np.all((lo[:, at] < middle) & (middle < hi[:, at]))
    outside = np.hstack([most, most * 0 - 1])
    np.testing.assert_array_equal(cells.find(outside), [-1, -1])
