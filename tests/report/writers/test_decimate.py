"""Protects the decimation of curves: fewer points, but the same peaks, gaps and steps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rbstab.report.model.figure import Axis, Figure, Line, Panel, Points, Stack
from rbstab.report.writers.decimate import decimate, kept_points, visible_points

HEIGHTS = st.floats(-1e6, 1e6, width=32) | st.sampled_from([np.nan, np.inf, -np.inf, 0.0])


def curves(shortest=0, longest=80):
    return arrays(float, st.integers(shortest, longest), elements=HEIGHTS)


def figure_of(*marks, log=False):
    return Figure("f", "F", (Panel(Axis("x"), Axis("y", log=log), marks),))


def left(mark, log=False, **options):
    (found,) = decimate(figure_of(mark, log=log), **options).panels[0].marks
    return found


def distance_to_curve(point, corners):
    """Return the distance of a point to the nearest straight segment between corners."""
    start, end = corners[:-1], corners[1:]
    along = end - start
    length = (along**2).sum(axis=1)
    share = ((point - start) * along).sum(axis=1) / np.where(length > 0, length, 1.0)
    foot = start + np.clip(share, 0, 1)[:, None] * along
    return np.sqrt(((foot - point) ** 2).sum(axis=1)).min()


@given(curves(), st.sampled_from([8, 20, 1000]), st.sampled_from([None, 1e-3, 0.1]))
def test_points_are_left_out_and_nothing_else(y, most, tolerance):
    x = np.arange(len(y), dtype=float)
    near = None if tolerance is None else np.array([len(y) * tolerance, 1e6 * tolerance])
    kept = kept_points(x, np.where(np.isfinite(y), y, np.nan), max_points=most, tolerance=near)
    assert (np.diff(kept) > 0).all()
    if len(y):
        assert (kept[0], kept[-1]) == (0, len(y) - 1)


@given(curves(3), st.sampled_from([1e-4, 1e-2, 0.1]))
def test_what_is_left_out_lies_on_the_curve_that_is_drawn(y, tolerance):
    y = np.where(np.isfinite(y), y, 0.5)
    x = np.arange(len(y), dtype=float)
    line = left(Line(x, y), tolerance=tolerance)
    spans = np.array([np.ptp(x), np.ptp(y) or 1.0])
    corners = np.column_stack([line.x, line.y]) / spans
    for point in np.column_stack([x, y]) / spans:
        assert distance_to_curve(point, corners) <= tolerance * (1 + 1e-9)


@given(st.lists(curves(longest=30), max_size=4), st.sampled_from([1e-3, 0.1]))
def test_several_curves_lose_the_points_that_each_loses_alone(heights, tolerance):
    each = [np.column_stack([np.arange(len(y), dtype=float), y]) for y in heights]
    near = np.array([30 * tolerance, 1e6 * tolerance])
    together = visible_points(each, near)
    alone = [kept_points(*curve.T, tolerance=near) for curve in each]
    assert [kept.tolist() for kept in together] == [kept.tolist() for kept in alone]


@given(curves(40, 400), st.sampled_from([16, 32]))
def test_of_very_many_points_every_peak_is_kept(y, most):
    seen = np.where(np.isfinite(y), y, np.nan)
    kept = kept_points(np.arange(len(y), dtype=float), seen, max_points=most)
    assert len(kept) <= 1.5 * most + 2
    stretch = 2 * len(y) / most + 1
    for place, height in enumerate(seen):
        if np.isfinite(height):
            near = seen[kept[np.abs(kept - place) <= stretch]]
            assert np.nanmax(near) >= height >= np.nanmin(near)


@given(curves(1), st.sampled_from([8, 1000]))
def test_the_highest_and_the_lowest_point_are_kept_exactly(y, most):
    line = left(Line(np.arange(len(y), dtype=float), y), max_points=most, tolerance=0.2)
    finite = y[np.isfinite(y)]
    if len(finite):
        shown = line.y[np.isfinite(line.y)]
        assert (shown.min(), shown.max()) == (finite.min(), finite.max())


@given(curves(2), st.sampled_from([8, 1000]))
def test_gaps_stay_gaps(y, most):
    x = np.arange(len(y), dtype=float)
    line = left(Line(x, y), max_points=most, tolerance=0.05)
    for first, last, before, after in zip(
        line.x[:-1], line.x[1:], line.y[:-1], line.y[1:], strict=True
    ):
        between = y[int(first) + 1 : int(last)]
        if np.isfinite([before, after]).all() and len(y) <= most:
            assert np.isfinite(between).all()
    assert np.isfinite(line.y).all() == np.isfinite(y).all()


@given(st.lists(st.sampled_from([-1.0, 0.0, 1.0, np.nan]), min_size=1, max_size=60))
def test_steps_are_the_same_between_all_points(levels):
    y = np.array(levels)
    x = np.arange(len(y), dtype=float)
    line = left(Line(x, y, step=True))
    rebuilt = line.y[np.searchsorted(line.x, x, side="right") - 1]
    np.testing.assert_array_equal(rebuilt, y)


def test_a_million_points_become_some_hundred():
    t = np.linspace(0, 1, 1_000_000)
    y = np.sin(3000 * t)
    y[123_456] = 7.0
    line = left(Line(t, y))
    assert len(line.x) <= 802
    assert line.y.max() == 7.0
    assert line.x[line.y.argmax()] == t[123_456]


def test_a_straight_line_needs_two_points():
    t = np.linspace(0, 1, 500)
    assert len(left(Line(t, 3 * t)).x) == 2
    assert len(left(Line(t, np.exp(-9 * t)), log=True).x) == 2
    assert len(left(Line(t, np.exp(-9 * t))).x) > 20


def test_on_a_logarithmic_axis_what_is_small_counts_as_much():
    t = np.linspace(0, 1, 401)
    y = 10.0 ** (-12 * t)
    y[300] *= 3.0
    assert y[300] in left(Line(t, y), log=True).y
    assert y[300] not in left(Line(t, y)).y


def test_a_loop_keeps_what_is_outermost_on_all_sides():
    turn = np.linspace(0, 2 * np.pi, 5001)
    x, y = np.cos(3 * turn), np.sin(5 * turn)
    line = left(Line(x, y))
    assert len(line.x) <= 802
    for whole, shown in ((x, line.x), (y, line.y)):
        assert (shown.min(), shown.max()) == (whole.min(), whole.max())


def test_the_parts_of_a_stack_stay_together():
    t = np.linspace(0, 1, 2001)
    parts = np.column_stack([np.exp(-5 * t), -(t**2), np.where(t > 0.5, 1.0, 0.0)])
    stack = left(Stack(t, parts, ("a", "b", "c")))
    places = np.searchsorted(t, stack.x)
    np.testing.assert_array_equal(stack.parts, parts[places])
    assert len(stack.x) < 200
    assert {1000, 1001} <= set(places.tolist())


@pytest.mark.parametrize("y", [[], [np.nan], [np.inf, 1.0], [1e308, -1e308, 1e308], [0.0, 0.0]])
@pytest.mark.parametrize("log", [False, True])
def test_odd_curves(y, log):
    x = np.arange(len(y), dtype=float)
    assert len(left(Line(x, np.array(y)), log=log).x) <= len(y)
    stack = Stack(x, np.array(y).reshape(-1, 1), ("a",))
    assert len(left(stack, log=log).x) <= len(y)


def test_other_marks_are_left_alone():
    points = Points(np.zeros(5000), np.zeros(5000))
    assert left(points) is points
