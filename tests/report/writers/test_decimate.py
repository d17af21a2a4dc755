"""Protects the decimation of curves: fewer points, but the same peaks, gaps and steps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rbstab.report.model.figure import Axis, Figure, Line, Panel, Stack
from rbstab.report.writers.decimate import MAX_POINTS, decimate, kept_points

HEIGHTS = st.floats(-1e6, 1e6, width=32) | st.sampled_from([np.nan, np.inf, -np.inf, 0.0])


def curves(shortest=0, longest=80):
    return arrays(float, st.integers(shortest, longest), elements=HEIGHTS)


def left(mark, log=False):
    figure = Figure("f", "F", (Panel(Axis("x"), Axis("y", log=log), (mark,)),))
    (thinned,) = decimate(figure).panels[0].marks
    return thinned


@given(curves(40, 400), st.sampled_from([16, 32]))
def test_of_very_many_points_every_peak_is_kept(y, most):
    seen = np.where(np.isfinite(y), y, np.nan)
    kept = kept_points(np.arange(len(y), dtype=float), seen, most)
    assert (np.diff(kept) > 0).all()
    assert (kept[0], kept[-1]) == (0, len(y) - 1)
    assert len(kept) <= 1.5 * most + 2
    stretch = 2 * len(y) / most + 1
    for place, height in enumerate(seen):
        if np.isfinite(height):
            near = seen[kept[np.abs(kept - place) <= stretch]]
            assert np.nanmax(near) >= height >= np.nanmin(near)


@given(curves(2), st.sampled_from([8, 1000]))
def test_gaps_stay_gaps(y, most):
    x, seen = np.arange(len(y), dtype=float), np.where(np.isfinite(y), y, np.nan)
    kept = kept_points(x, seen, most)
    assert np.isfinite(seen[kept]).all() == np.isfinite(seen).all()
    assert len(kept) == len(y) or len(y) > most


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
    assert len(line.x) <= MAX_POINTS + 2
    assert line.y.max() == 7.0
    assert line.x[line.y.argmax()] == t[123_456]


def test_a_loop_keeps_what_is_outermost_on_all_sides():
    turn = np.linspace(0, 2 * np.pi, 5001)
    x, y = np.cos(3 * turn), np.sin(5 * turn)
    line = left(Line(x, y))
    assert len(line.x) <= MAX_POINTS + 2
    for whole, shown in ((x, line.x), (y, line.y)):
        assert (shown.min(), shown.max()) == (whole.min(), whole.max())


def test_the_parts_of_a_stack_stay_together():
    t = np.linspace(0, 1, 5001)
    parts = np.column_stack([np.exp(-5 * t), -(t**2), np.where(t == 0.5, 1.0, 0.0)])
    stack = left(Stack(t, parts, ("a", "b", "c")))
    places = np.searchsorted(t, stack.x)
    np.testing.assert_array_equal(stack.parts, parts[places])
    assert len(stack.x) < 5 * MAX_POINTS
    assert 2500 in places.tolist()


@pytest.mark.parametrize("y", [[], [np.nan], [np.inf, 1.0], [1e308, -1e308, 1e308], [0.0, 0.0]])
@pytest.mark.parametrize("log", [False, True])
def test_odd_curves(y, log):
    x = np.arange(len(y), dtype=float)
    assert len(left(Line(x, np.array(y)), log=log).x) <= len(y)
    stack = Stack(x, np.array(y).reshape(-1, 1), ("a",))
    assert len(left(stack, log=log).x) <= len(y)
