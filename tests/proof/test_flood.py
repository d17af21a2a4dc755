"""Floods and regions of functions whose passes are known, and wrong floods that must be seen."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from rbstab.proof import flood as floods
from rbstab.proof.bounds import BoundedEnergy
from rbstab.proof.expr import variable
from rbstab.proof.flood import Cells, Land, flood
from rbstab.proof.levels import Ranges
from rbstab.proof.model import Energy
from rbstab.proof.regions import regions_of
from rbstab.proof.search import Box, Search

PI = np.nextafter(np.pi, 4)
END = np.array([PI, np.nextafter(np.pi / 2, 2), PI])
RANGE = Box(-END, END)
X, Y, Z = (variable(k) for k in range(3))
BOWL = 10 * Y * Y + 10 * Z * Z


def found(U, box=RANGE, closed=frozenset(), proved=True):
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


def test_a_pendulum_turns_over_at_twice_its_weight():
    """m g l (1 - cos θ1) is 2 m g l at ±π: c* = 2 m g l. There it may rest, on the border."""
    _, regions = found(3 * (1 - X.cos()) + BOWL, proved=False)
    assert regions.certified.energy == pytest.approx(6, rel=1e-9)
    assert 6 * (1 - 1e-7) < regions.certified.lower_bound <= 6
    assert regions.certified.face == (0, -1)
    (region,) = regions.minima
    assert 6 * (1 - 1e-5) < region.lower_bound <= 6


def test_a_closed_axis_has_no_faces():
    """Then the least energy is that of θ2 = ±π/2, by y alone: 10 (π/2)²."""
    _, regions = found(3 * X * X + BOWL, closed=frozenset({0}))
    assert regions.certified.energy == pytest.approx(10 * (np.pi / 2) ** 2, rel=1e-9)
    assert regions.certified.face == (1, -1)


def test_two_wells_end_at_the_saddle_between_them():
    """Both regions have its energy; c* is that of the other minimum."""
    low, top, high = wells_at(0.25)
    zeros, regions = found(wells(0.25))
    assert [zero.index for zero in zeros.zeros] == [0, 0, 1]
    assert regions.certified.energy_bound == pytest.approx(high, abs=1e-9)
    assert regions.certified.energy_bound <= high + 1e-12
    heights = [region.lower_bound for region in regions.minima]
    np.testing.assert_allclose(heights, [top - low, top - high], rtol=1e-5)
    assert heights[0] <= top - low
    assert heights[1] <= top - high
    assert {region.pass_state for region in regions.minima} == {2}


def test_starts_belong_to_the_well_in_which_they_are():
    """Of points with less energy than the saddle: those on its side of it."""
    zeros, regions = found(wells(0.25))
    middle = zeros.zeros[2].point[0]
    rng = np.random.default_rng(3)
    x = rng.uniform([-1.5, -0.3, -0.3], [1.5, 0.3, 0.3], size=(4000, 3)).T
    value = (x[0] ** 2 - 1) ** 2 + 0.25 * x[0] + 10 * (x[1] ** 2 + x[2] ** 2)
    x = x[:, value < regions.minima[0].energy_bound - 1e-9]
    inside = [region.flooded.contains(x - 1e-12, x + 1e-12) for region in regions.minima]
    np.testing.assert_array_equal(inside[0], x[0] < middle)
    np.testing.assert_array_equal(inside[1], x[0] > middle)
    assert inside[0].any()
    assert inside[1].any()


def test_a_start_partly_outside_of_a_region_is_not_in_it():
    """Nor one that is outside the range, or is too wide."""
    _, regions = found(wells(0.25))
    contains = regions.minima[0].flooded.contains
    at = np.array([-1.0, 0.0, 0.0])[:, None]
    wide = np.array([1.8, 0.0, 0.0])[:, None]
    assert contains(at, at)[0]
    assert not contains(at, at + wide)[0]
    assert not contains(at - 10, at)[0]


def test_the_face_by_which_a_component_leaves_is_the_pass():
    """x² - x⁴/12 has its top at √6 in [-π, π]; here the range ends before it, at 2."""
    end = np.array([2.0, 1.0, 1.0])
    _, regions = found(X * X - X**4 / 12 + BOWL, Box(-end, end))
    (region,) = regions.minima
    assert region.pass_face == (0, -1)
    assert region.lower_bound == pytest.approx(4 - 16 / 12, rel=1e-6)


def test_a_minimum_above_all_faces_has_a_region():
    """(x² - 1)² + 2x and the face x = -1.9 below the upper minimum: it ends at the saddle."""
    end = np.array([1.9, 1.0, 1.0])
    _, top, high = wells_at(1.0)
    _, regions = found(wells(1), Box(np.array([-1.15, -1.0, -1.0]), end))
    upper = regions.minima[-1]
    assert upper.lower_bound == pytest.approx(top - high, rel=1e-5)
    assert upper.lower_bound <= top - high


def lands():
    """Return the land of two wells, the upper minimum, the lower one, and the saddle's V."""
    zeros, _ = found(wells(0.25))
    land = Land(Ranges.of(Energy(wells(0.25))), RANGE, (0, 1, 2))
    low, high, _ = zeros.zeros
    return land, high.enclosure, low.enclosure, wells_at(0.25)[1]


def test_a_flood_above_the_saddle_reaches_the_other_well():
    """Just below it does not."""
    land, start, other, saddle = lands()
    high = np.zeros((3, 1))
    assert flood(land, start, saddle - 1e-4, [other], high).holds
    above = flood(land, start, saddle + 1e-2, [other], high)
    assert not above.holds
    assert above.states == (0,)


def test_a_flood_that_has_V_equal_to_the_level_on_a_face_holds():
    """V = x² on a range that ends at 1: a component of {V < 1} does not reach the face."""
    end = np.array([1.0, 1.0, 1.0])
    land = Land(Ranges.of(Energy(X * X + BOWL)), Box(-end, end), (0, 1, 2))
    start = Box(-np.full(3, 1e-9), np.full(3, 1e-9))
    assert flood(land, start, 1 - 1e-9).holds
    reached = flood(land, start, 1 + 1e-3)
    assert not reached.holds
    assert {(axis, sign) for axis, sign, _ in reached.faces} == {(0, -1), (0, 1)}


def test_each_face_counts():
    """A well that slopes down to one face alone leaves by this one."""
    for axis, sign in ((0, -1), (0, 1), (1, -1), (1, 1), (2, -1), (2, 1)):
        x, end = variable(axis), END[axis]
        # ½ end² at one end, and 1.5 end² at the other; at least 24 J on all other faces.
        U = BOWL + 10 * X * X - 9 * x * x - Fraction(sign) / (2 * Fraction(end)) * x**3
        land = Land(Ranges.of(Energy(U)), RANGE, (0, 1, 2))
        start = Box(-np.full(3, 1e-9), np.full(3, 1e-9))
        assert flood(land, start, 0.49 * end**2).holds
        reached = flood(land, start, 0.6 * end**2)
        assert not reached.holds
        assert {(one, side) for one, side, _ in reached.faces} == {(axis, sign)}


def test_cells_of_all_depths_have_their_neighbours():
    """Pairs are those of boxes whose common part is a face, by their corners."""
    cells = Cells.of(RANGE, 1)
    rng = np.random.default_rng(1)
    for _ in range(2):
        split = rng.random(cells.count) < 0.2
        cells = cells[~split].joined(cells[split].eighths())
    one, two = cells.neighbours()
    pairs = {frozenset(pair) for pair in zip(one.tolist(), two.tolist(), strict=True)}
    lo, hi = cells.boxes
    expected = set()
    for k in range(cells.count):
        size = np.minimum(hi, hi[:, [k]]) - np.maximum(lo, lo[:, [k]])
        touching = ((size == 0).sum(axis=0) == 1) & ((size > 0).sum(axis=0) == 2)
        expected |= {frozenset((k, j)) for j in np.flatnonzero(touching).tolist()}
    assert pairs == expected


def test_cells_fill_the_range():
    """Their volumes sum up to that of the range, and the outer ones end where it ends."""
    cells = Cells.of(RANGE, 2)
    lo, hi = cells.boxes
    assert np.prod(hi - lo, axis=0).sum() == pytest.approx(np.prod(2 * END))
    assert np.all(lo.min(axis=1) == -END)
    assert np.all(hi.max(axis=1) == END)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_skipped_neighbour_would_be_seen(monkeypatch, axis):
    """A flood that does not cross one face of cells stays in a half of a plain bowl."""
    whole = Cells.neighbours

    def skipping(self):
        one, two = whole(self)
        apart = self.boxes.lo[axis, one] == self.boxes.hi[axis, two]
        apart |= self.boxes.hi[axis, one] == self.boxes.lo[axis, two]
        return one[~apart], two[~apart]

    land = Land(Ranges.of(Energy(BOWL + 10 * X * X)), RANGE, (0, 1, 2))
    start = Box(np.full(3, 0.1), np.full(3, 0.11))
    right = flood(land, start, 5.0)
    assert right.contains(-np.full((3, 1), 0.3), -np.full((3, 1), 0.3))[0]
    monkeypatch.setattr(floods.Cells, "neighbours", skipping)
    wrong = flood(land, start, 5.0)
    assert not wrong.contains(-np.full((3, 1), 0.3), -np.full((3, 1), 0.3))[0]


def test_an_undecided_box_ends_all_regions():
    """No level is above the least energy in it."""
    zeros, before = found(wells(0.25))
    place = np.array([[0.4], [0.0], [0.0]])
    undecided = type(zeros.undecided)(place, place + 1e-3)
    regions = regions_of(Energy(wells(0.25)), replace(zeros, undecided=undecided), RANGE)
    value = (0.401**2 - 1) ** 2 + 0.25 * 0.401 + 2e-5
    assert before.minima[0].energy_bound > value
    for region in regions.minima:
        assert region.energy_bound <= value
        assert region.pass_at is None


def test_an_undecided_box_bounds_c_star():
    """It may contain a rest state that is lower than all others but the lowest."""
    zeros, before = found(wells(0.25))
    place = np.array([[-0.9], [0.0], [0.0]])
    undecided = type(zeros.undecided)(place, place + 1e-3)
    regions = regions_of(Energy(wells(0.25)), replace(zeros, undecided=undecided), RANGE)
    value = (0.81 - 1) ** 2 - 0.25 * 0.9
    bounds = [
        one.certified.energy_bound
        for one in (before, regions)
        if one.certified is not None and one.certified.energy_bound is not None
    ]
    assert bounds[0] > value + 0.1
    assert value - 0.01 < bounds[1] <= value
