"""Regions of functions whose passes are known, and wrong graphs of cells that must be seen."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from rbstab.proof.boxes import Box, joined
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.enclosures.levels import Ranges
from rbstab.proof.exact.expr import variable
from rbstab.proof.model import Energy
from rbstab.proof.regions.cells import Cells
from rbstab.proof.regions.landscape import Landscape
from rbstab.proof.regions.regions import CHECKED, regions_of
from rbstab.proof.regions.starts import RegionLevel, StartRegions
from rbstab.proof.search import Search, Zeros
from rbstab.proof.zeros import Zero

PI = np.nextafter(np.pi, 4)
END = np.array([PI, np.nextafter(np.pi / 2, 2), PI])
RANGE = Box(-END, END)
X, Y, Z = (variable(k) for k in range(3))
BOWL = 10 * Y * Y + 10 * Z * Z


def searched(U, box=RANGE, closed=frozenset(), proved=True):
    """Return the rest states and the regions of an energy."""
    energy = Energy(U, closed=closed)
    zeros = Search(BoundedEnergy(U, least=energy.least), box).run(20_000)
    assert zeros.proved == proved
    return zeros, regions_of(energy, zeros, box)


def wells(tilt):
    """Return (x² - 1)² + tilt·x + 10 (y² + z²): two minima at about x = ±1, a saddle near 0."""
    return X**4 - 2 * X * X + 1 + Fraction(tilt) * X + BOWL


def wells_at(tilt):
    """Return V at the three rest states by x: the roots of 4x³ - 4x + tilt."""
    roots = np.sort(np.roots([4, 0, -4, tilt]).real)
    return (roots**2 - 1) ** 2 + tilt * roots


def test_a_closed_axis_has_no_faces():
    """Then the least energy is that of θ2 = ±π/2, by y alone: 10 (π/2)²."""
    _, regions = searched(3 * X * X + BOWL, closed=frozenset({0}))
    assert regions.certified.energy == pytest.approx(10 * (np.pi / 2) ** 2, rel=1e-9)
    assert regions.certified.face == "θ2 = -π/2"


def test_two_wells_end_at_the_saddle_between_them(two_wells):
    """Both regions have its energy; c* is that of the other minimum."""
    low, top, high = wells_at(0.25)
    zeros, regions = two_wells
    assert [zero.index for zero in zeros.zeros] == [0, 0, 1]
    margin = CHECKED * (high - low)  # the proved level is so much lower
    assert regions.certified.energy_bound == pytest.approx(high - margin, abs=1e-9)
    assert regions.certified.energy_bound < high
    heights = [region.lower_bound for region in regions.minima]
    np.testing.assert_allclose(heights, [top - low, top - high], rtol=1e-5)
    assert heights[0] <= top - low
    assert heights[1] <= top - high
    assert {region.pass_state for region in regions.minima} == {3}


@pytest.fixture(scope="module")
def two_wells():
    return searched(wells(0.25))


def starts_of(zeros, regions, higher=0.0):
    """Return the regions for starts, up to their levels or higher."""
    levels = [
        RegionLevel(region.rest_state - 1, region.energy_bound + higher)
        for region in regions.minima
    ]
    return StartRegions(Energy(wells(0.25)), zeros, RANGE, levels)


def test_starts_belong_to_the_well_in_which_they_are(two_wells):
    """Of points with less energy than the saddle: those on its side of it."""
    zeros, regions = two_wells
    middle = zeros.zeros[2].point[0]
    x = np.random.default_rng(3).uniform([-1.5, -0.3, -0.3], [1.5, 0.3, 0.3], size=(4000, 3))
    x[::7, 2] = 0.0  # on faces of cells
    value = (x[:, 0] ** 2 - 1) ** 2 + 0.25 * x[:, 0] + 10 * (x[:, 1] ** 2 + x[:, 2] ** 2)
    below = value < regions.minima[0].energy_bound - 1e-9
    x, value = x[below], value[below]
    starts = starts_of(zeros, regions)
    inside = starts.find(value, x - 1e-12, x + 1e-12)
    np.testing.assert_array_equal(inside, np.where(x[:, 0] < middle, 0, 1))
    assert 0 < inside.sum() < len(inside)
    np.testing.assert_array_equal(starts.find(value + 9, x, x), -1)


@pytest.mark.parametrize(
    ("low", "high", "expected"), [(0, 0, 0), (0, 0.01, 0), (0, 1.8, -1), (-10, 0, -1)]
)
def test_a_start_partly_outside_of_a_region_is_not_in_it(two_wells, low, high, expected):
    """Nor one that is outside the range, or is too wide."""
    at, zero = np.array([[-1.0, 0.0, 0.0]]), np.zeros(1)
    assert starts_of(*two_wells).find(zero, at + low, at + high) == [expected]


def test_a_level_above_the_pass_proves_nothing_of_starts(two_wells):
    """The cells do not show that the component ends."""
    at = np.array([[-1.0, 0.0, 0.0]])
    zeros, regions = two_wells
    assert starts_of(zeros, regions, 1e-2).find(np.zeros(1), at, at) == [-1]


@pytest.mark.parametrize("x", [0.4, -0.9])
def test_an_undecided_box_ends_all_regions(two_wells, x):
    """No level is above the least energy in it; in a well it may contain a lower rest state."""
    zeros, before = two_wells
    place = np.array([[x], [0.0], [0.0]])
    undecided = type(zeros.undecided)(place, place + 1e-3)
    after = regions_of(Energy(wells(0.25)), replace(zeros, undecided=undecided), RANGE)
    value = (x**2 - 1) ** 2 + 0.25 * x
    assert after.minima or x < 0
    for region in after.minima:
        assert value - 0.01 < region.energy_bound <= value + 2e-5
        assert region.pass_at is None
    if x < 0:
        assert before.certified is not None
        assert after.certified is not None
        assert before.certified.energy_bound > value + 0.1
        assert value - 0.01 < after.certified.energy_bound <= value


def test_the_face_by_which_a_component_leaves_is_the_pass():
    """x² - x⁴/12 has its top at √6 in [-π, π]; here the range ends before it, at 2."""
    end = np.array([2.0, 1.0, 1.0])
    _, regions = searched(X * X - X**4 / 12 + BOWL, Box(-end, end))
    (region,) = regions.minima
    assert {region.pass_face} == {"θ1 = -2"}
    assert region.lower_bound == pytest.approx(4 - 16 / 12, rel=1e-6)


def test_a_minimum_above_all_faces_has_a_region():
    """(x² - 1)² + 2x and the face x = -1.9 below the upper minimum: it ends at the saddle."""
    end = np.array([1.9, 1.0, 1.0])
    _, top, high = wells_at(1.0)
    _, regions = searched(wells(1), Box(np.array([-1.15, -1.0, -1.0]), end))
    upper = regions.minima[-1]
    assert upper.lower_bound == pytest.approx(top - high, rel=1e-5)
    assert upper.lower_bound <= top - high


def cells_of(U, places, box=RANGE):
    """Return the first cells of a range with rest states in some boxes."""
    zeros = tuple(Zero(at.lo, at, at, 0, 0.0) for at in places)
    energy = Energy(U)
    return Cells.of(Landscape(energy, Zeros(zeros, joined([], 3), 0), box, Ranges.of(energy)))


def around(*x):
    """Return a small box about a point."""
    return Box(np.array(x) - 1e-9, np.array(x) + 1e-9)


def test_no_cells_prove_more_than_the_pass(two_wells):
    """With cells of any size: those at first, and those after each step."""
    zeros, _ = two_wells
    cells = cells_of(wells(0.25), [zero.enclosure for zero in zeros.zeros])
    saddle, previous = wells_at(0.25)[1], [-np.inf, -np.inf]
    while True:
        levels = [cells.flood(k).end.level for k in (0, 1)]
        assert max(levels) <= saddle
        assert levels >= previous  # smaller cells never prove less
        some = cells.ways(0, saddle - 1e-4).open
        if not len(some):
            break
        cells, previous = cells.divided(some), levels
    assert min(levels) >= saddle - 1e-4


def test_a_component_with_V_equal_to_the_level_on_a_face_ends():
    """V = x² on a range that ends at 1: a component of {V < 1} does not reach the face."""
    end = np.array([1.0, 1.0, 1.0])
    cells = cells_of(X * X + BOWL, [around(0.0, 0.0, 0.0)], Box(-end, end)).up_to(0, 1 - 1e-9)
    reached = cells.flood(0).end
    assert 1 - 1e-9 <= reached.level <= 1
    assert cells.border in reached.edge
    assert len(cells.up_to(0, 1 + 1e-3).ways(0, 1 + 1e-3).ends)


def test_each_face_counts():
    """A well that slopes down to one face alone leaves by this one."""
    for axis, sign in ((0, -1), (0, 1), (1, -1), (1, 1), (2, -1), (2, 1)):
        x, end = variable(axis), END[axis]
        # ½ end² at one end, and 1.5 end² at the other; at least 24 J on all other faces.
        U = BOWL + 10 * X * X - 9 * x * x - Fraction(sign) / (2 * Fraction(end)) * x**3
        zeros, regions = searched(U)
        region = regions.minima[0]
        assert zeros.zeros[region.rest_state - 1].index == 0
        assert region.pass_face == f"θ{axis + 1} = {'-' * (sign < 0)}{'π/2' if axis == 1 else 'π'}"
        assert 0.5 * end**2 * (1 - 1e-5) < region.lower_bound <= 0.5 * end**2


def test_neighbours_are_those_with_a_common_face():
    """Of cells of many sizes, by comparing all of them; each pair once."""
    cells, rng = cells_of(BOWL + X * X, [around(0.1, 0.1, 0.1)]), np.random.default_rng(4)
    for _ in range(4):
        lo, hi = cells.boxes
        pairs = [frozenset(pair) for pair in cells.pairs.T.tolist()]
        expected = set()
        for k in range(cells.count):
            size = np.minimum(hi, hi[:, [k]]) - np.maximum(lo, lo[:, [k]])
            beside = ((size == 0).sum(axis=0) == 1) & ((size > 0).sum(axis=0) == 2)
            expected |= {frozenset((k, j)) for j in np.flatnonzero(beside).tolist()}
        assert len(pairs) == len(set(pairs))
        assert set(pairs) == expected
        assert np.prod(hi - lo, axis=0).sum() == pytest.approx(np.prod(2 * END), rel=1e-12)
        np.testing.assert_array_equal(cells.touching[0], cells.boxes.touch(around(0.1, 0.1, 0.1)))
        cells = cells.divided(np.flatnonzero(rng.random(cells.count) < 0.15))
    assert len(set(cells.depth.tolist())) > 3
