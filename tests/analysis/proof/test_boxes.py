"""Boxes of angles: halves, hulls and ranges cover all that they must, despite round-off."""

import math
from fractions import Fraction

import mpmath
import numpy as np

from rbstab.analysis.proof.boxes import (
    RANGE_END,
    Boxes,
    box_around,
    hulls,
    joined,
    no_boxes,
    whole_range,
)


def random_boxes(rng, count=50):
    low = rng.uniform(-3, 3, size=(count, 3))
    return Boxes(low, low + rng.uniform(0, 1, size=(count, 3)) ** 5)


def test_range_holds_its_ends():
    with mpmath.workdps(40):
        for end, exact in zip(RANGE_END, (mpmath.pi, mpmath.pi / 2, mpmath.pi), strict=True):
            assert mpmath.mpf(float(end)) > exact
            assert mpmath.mpf(float(np.nextafter(end, 0))) < exact
    whole = whole_range()
    np.testing.assert_array_equal([whole.low[0], whole.high[0]], [-RANGE_END, RANGE_END])


def test_whole_range_is_made_anew():
    whole_range().high[0, 0] = 9.0
    assert RANGE_END[0] < 4
    assert whole_range().high[0, 0] < 4


def test_reach_covers_the_box(rng):
    # Ends of very different sizes, so that sums and differences are rounded.
    ends = rng.normal(size=(2, 200, 3)) * 10.0 ** rng.integers(-9, 1, size=(2, 200, 3))
    boxes = Boxes(ends.min(axis=0), ends.max(axis=0))
    # fsum rounds the exact sum once, so its sign is right.
    for low, high, centre, radius in zip(
        boxes.low.ravel(),
        boxes.high.ravel(),
        boxes.centre.ravel(),
        boxes.radius.ravel(),
        strict=True,
    ):
        assert low <= centre <= high
        assert math.fsum([centre, radius, -high]) >= 0
        assert math.fsum([low, radius, -centre]) >= 0


def test_halves_cover_the_box_and_meet(rng):
    boxes = random_boxes(rng)
    axis = rng.integers(0, 3, size=len(boxes))
    halves = boxes.halves(axis)
    assert len(halves) == 2 * len(boxes)
    left, right = halves[: len(boxes)], halves[len(boxes) :]
    rows = np.arange(len(boxes))
    np.testing.assert_array_equal(left.low, boxes.low)
    np.testing.assert_array_equal(right.high, boxes.high)
    np.testing.assert_array_equal(left.high[rows, axis], right.low[rows, axis])
    np.testing.assert_array_equal(left.high[rows, axis], boxes.centre[rows, axis])
    assert np.all(left.within(Boxes(boxes.low.min(axis=0)[None], boxes.high.max(axis=0)[None])))
    untouched = np.ones((len(boxes), 3), dtype=bool)
    untouched[rows, axis] = False
    np.testing.assert_array_equal(left.high[untouched], boxes.high[untouched])
    np.testing.assert_array_equal(right.low[untouched], boxes.low[untouched])


def test_within_and_meets():
    unit = Boxes(np.zeros((1, 3)), np.ones((1, 3)))
    low = np.array([[0, 0, 0], [0.2, 0.2, 0.2], [-0.1, 0, 0], [1, 1, 1], [1.1, 0, 0]], dtype=float)
    high = np.array([[1, 1, 1], [0.4, 0.4, 1.1], [0.5, 1, 1], [2, 2, 2], [2, 1, 1]], dtype=float)
    boxes = Boxes(low, high)
    np.testing.assert_array_equal(boxes.within(unit), [True, False, False, False, False])
    np.testing.assert_array_equal(boxes.intersects(unit), [True, True, True, True, False])


def test_box_around_a_point_is_rounded_outwards(rng):
    point = rng.normal(size=3)
    box = box_around(point, 0.1)
    for x, low, high in zip(point, box.low[0], box.high[0], strict=True):
        assert math.fsum([x, -0.1, -low]) > 0
        assert math.fsum([x, 0.1, -high]) < 0


def test_joining_nothing():
    assert len(joined([no_boxes(), no_boxes()])) == 0
    assert no_boxes().radius.shape == (0, 3)


def test_hulls_take_what_touches_together():
    low = np.array([[0, 0, 0], [5, 5, 5], [2, 0, 0], [1, 0, 0]], dtype=float)
    found = hulls(Boxes(low, low + 1))
    np.testing.assert_array_equal(found.low, [[0, 0, 0], [5, 5, 5]])
    np.testing.assert_array_equal(found.high, [[3, 1, 1], [6, 6, 6]])
    assert len(hulls(no_boxes())) == 0


def test_hulls_cover_every_box(rng):
    boxes = random_boxes(rng)
    found = hulls(boxes)
    covered = [boxes.within(found[k : k + 1]) for k in range(len(found))]
    assert np.all(np.any(covered, axis=0))


def test_hulls_of_boxes_that_fill_a_part_of_the_range():
    """Halves of halves, as a search leaves them, in any order; one of them lies apart."""
    parts = Boxes(np.array([[0.0, 0.0, 0.0]]), np.array([[4.0, 2.0, 1.0]]))
    for axis in (0, 1, 2, 0, 1):
        parts = parts.halves(np.full(len(parts), axis))
    away = Boxes(np.array([[5.0, 0.0, 0.0]]), np.array([[6.0, 1.0, 1.0]]))
    order = np.random.default_rng(0).permutation(len(parts) + 1)
    found = hulls(joined([parts, away])[order])
    along = found.low[:, 0].argsort()
    np.testing.assert_array_equal(found.low[along], [[0, 0, 0], [5, 0, 0]])
    np.testing.assert_array_equal(found.high[along], [[4, 2, 1], [6, 1, 1]])


def test_hulls_do_not_join_rows_that_only_overlap_along_one_axis():
    low = np.array([[0, 0, 0], [1, 3, 0], [0, 0, 3]], dtype=float)
    assert len(hulls(Boxes(low, low + 1))) == 3


def test_inner_radius_stays_in_the_box(rng):
    """Also where the centre is rounded: then the two sides of a box differ by the last digit."""
    low = rng.uniform(-3, 3, size=(1000, 3))
    boxes = Boxes(low, low + 10.0 ** rng.uniform(-15, -1, size=(1000, 3)))
    for axis in range(3):
        for m in range(1000):
            middle = Fraction(boxes.centre[m, axis])
            inner, outer = (
                Fraction(radius[m, axis]) for radius in (boxes.inner_radius, boxes.radius)
            )
            ends = Fraction(boxes.low[m, axis]), Fraction(boxes.high[m, axis])
            assert ends[0] <= middle - inner
            assert middle + inner <= ends[1]
            assert middle - outer <= ends[0]
            assert ends[1] <= middle + outer
