"""Protects the colour scales of maps: ends, enough round ticks, and the edges of cells."""

import numpy as np
import pytest

from rbstab.report.model.figure import Axis, Cells
from rbstab.report.model.palette import DIVERGING
from rbstab.report.writers.colour_scale import (
    bar_title,
    cell_edges,
    diverges,
    diverging_colours,
    scale_ends,
    scale_ticks,
)

RANGES = [
    *((0.0, 1.0), (0.4, 1.2), (0.0376, 0.1128), (-3e-7, 2e-7), (999.9999, 1000.0001)),
    *((-40.0, 40.0), (1e-13, 1.9e-13), (0.99, 1.01)),
]


@pytest.mark.parametrize(("low", "high"), RANGES)
def test_a_linear_scale_has_three_to_twelve_round_labels(low, high):
    ticks = scale_ticks(low, high, log=False)
    assert 3 <= len(ticks) <= 12
    assert all(low <= tick <= high for tick in ticks)
    steps = np.diff(list(ticks))
    assert steps == pytest.approx(steps[0])
    # 1, 2 or 5 times a power of ten.
    assert (
        min(abs(steps[0] / 10.0 ** np.floor(np.log10(steps[0]) + 1e-9) - n) for n in (1, 2, 5))
        < 1e-6
    )
    assert len(set(ticks.values())) == len(ticks)
    assert [float(label) for label in ticks.values()] == pytest.approx(
        list(ticks), abs=1e-3 * steps[0]
    )


@pytest.mark.parametrize(
    ("low", "high"), [(0.5, 3.0), (0.5, 1e3), (1e-30, 1.0), (2.0, 2.5), (3.0, 40)]
)
def test_a_logarithmic_scale_has_three_to_twelve_labels(low, high):
    ticks = scale_ticks(low, high, log=True)
    assert 3 <= len(ticks) <= 12
    assert all(low <= tick <= high for tick in ticks)
    assert [float(label) for label in ticks.values()] == pytest.approx(list(ticks))


def cells(values, span=None, log=False):
    middles = np.arange(float(len(values)))
    return Cells(middles, np.zeros(1), np.array([values]), Axis("z", log=log), span)


def test_a_scale_is_never_empty():
    assert scale_ends(cells([2.0, np.nan, 5.0])) == (2.0, 5.0)
    assert scale_ends(cells([-1.0, 2.0, 5.0], log=True)) == (2.0, 5.0)
    assert scale_ends(cells([2.0, 5.0], span=(0.0, 9.0))) == (0.0, 9.0)
    for values, log in (([7.0, 7.0], False), ([0.0], False), ([7.0], True), ([np.nan], True)):
        low, high = scale_ends(cells(values, log=log))
        assert low < high
    # One value has the colour in the middle, as the scale measures it.
    assert np.mean(scale_ends(cells([7.0, 7.0]))) == 7.0
    assert np.prod(scale_ends(cells([7.0], log=True))) == pytest.approx(49.0)


def test_edges_are_halfway_on_their_axis():
    assert cell_edges(np.array([1.0, 2.0, 4.0]), Axis("x")).tolist() == [0.5, 1.5, 3.0, 5.0]
    logarithmic = cell_edges(np.array([1.0, 100.0]), Axis("x", log=True))
    assert logarithmic == pytest.approx([0.1, 10.0, 1000.0])
    assert cell_edges(np.array([3.0]), Axis("x")).tolist() == [2.5, 3.5]


@pytest.mark.parametrize("log", [True, False])
def test_a_diverging_scale_is_white_in_its_middle_and_ends_where_its_values_end(log):
    """A v(0) / c* below zero, which does not exist, has no place on the bar."""
    both = np.array([[0.1, 2.0], [np.nan, 50.0]])
    scale = Axis("v(0) / c*", log=log, middle=1.0)
    shown = Cells(np.arange(2.0), np.arange(2.0), both, scale)
    assert diverges(shown)
    assert scale_ends(shown) == pytest.approx((0.1, 50.0))
    measure = np.log if log else np.array
    low, middle, high = map(float, measure([0.1, 1.0, 50.0]))
    stops = dict(diverging_colours(shown))
    assert stops[(middle - low) / (high - low)] == DIVERGING[2]
    # The side that reaches farther ends in its full colour, the other one as far from white as
    # its end is from the middle.
    assert sorted(stops) == list(stops)
    assert (min(stops), max(stops)) == (0.0, 1.0)
    assert stops[1.0] == DIVERGING[-1]
    reds = [int(tone[1:3], 16) for tone in DIVERGING]
    expected = np.interp(2 - 2 * (middle - low) / (high - middle), range(len(reds)), reds)
    assert int(stops[0.0][1:3], 16) == pytest.approx(expected, abs=0.5)
    above = Cells(np.arange(2.0), np.arange(2.0), both + 1, scale)
    assert not diverges(above)
    assert scale_ends(above) == pytest.approx((1.1, 51.0))


def test_a_logarithmic_bar_is_called_so():
    assert bar_title(Axis("v", "J", log=True), titled=True) == "v [J], logarithmic"
    assert bar_title(Axis("v", "J", log=True), titled=False) == "logarithmic"
    assert bar_title(Axis("v", "J"), titled=False) == ""
