"""Protects the split time axis: fast transients get room, other figures keep one linear axis."""

import numpy as np
import pytest

from rbstab.report.model.figure import Axis, Figure, Line, Panel, Points, Stack
from rbstab.report.model.split_time import FIRST_SHARE, SplitTime
from rbstab.report.runs.figures.time_axis import (
    FAST,
    MIN_SAMPLES,
    MOST,
    end_of_change,
    with_room_for_transients,
)

T = np.linspace(0.0, 2.0, 1001)


def figure_of(*curves, log=False, **options):
    panels = tuple(
        Panel(Axis("time t", "s"), Axis(f"y{n}", log=log), (Line(T, y),))
        for n, y in enumerate(curves)
    )
    return Figure("f", "F", panels, **({"shares_time": True} | options))


def split_of(figure):
    (split,) = {panel.x.split for panel in with_room_for_transients([figure])[0].panels}
    return split


@pytest.mark.parametrize("rate", [5.0, 30.0, 80.0])
def test_the_change_of_a_decay_ends_where_the_closed_form_says(rate):
    # 1 - e^(-rate t) of all change has happened at t, but for e^(-rate T).
    expected = -np.log(1 - MOST * (1 - np.exp(-rate * T[-1]))) / rate
    found = end_of_change(T, 7 * np.exp(-rate * T) + 3)
    assert expected <= found <= expected + T[1] + 1e-12


def test_a_fast_decay_splits_the_axis_where_it_is_over():
    rate = 30.0
    split = split_of(figure_of(np.exp(-rate * T)))
    over = -np.log(1 - MOST) / rate
    assert (split.begin, split.end) == (0.0, 2.0)
    assert split.at == pytest.approx(0.1)
    assert over < split.at
    caption = with_room_for_transients([figure_of(np.exp(-rate * T), caption="Words.")])[0].caption
    assert caption.startswith("Words. The time axis has two scales")
    assert "0.1 s" in caption
    assert "y0" in caption
    # A second has the width 0.4/0.1 before, and 0.6/1.9 after.
    assert f"{0.4 / 0.1 / (0.6 / 1.9):.2g} times" in caption


@pytest.mark.parametrize(
    "curve",
    [np.exp(-2 * T), np.sin(9 * T), 0 * T, np.full(len(T), np.nan), 1 + 0 * T],
)
def test_without_a_fast_transient_nothing_changes(curve):
    figure = figure_of(curve)
    assert with_room_for_transients([figure]) == [figure]


def test_the_change_counts_as_it_is_drawn():
    # On a logarithmic axis a decay is a straight line.
    assert split_of(figure_of(np.exp(-30 * T))) is not None
    assert split_of(figure_of(np.exp(-30 * T), log=True)) is None


def test_a_change_that_is_not_visible_counts_no_more_than_noise():
    slow, small = np.sin(2 * T), 1e-3 * np.exp(-30 * T)
    panel = Panel(Axis("time t", "s"), Axis("y"), (Line(T, slow), Line(T, small)))
    figure = Figure("f", "F", (panel,), shares_time=True)
    assert with_room_for_transients([figure]) == [figure]


def test_all_panels_of_a_figure_have_the_same_axis():
    assert split_of(figure_of(np.exp(-30 * T), np.sin(2 * T))).at == pytest.approx(0.1)


def test_the_fastest_transient_decides_and_the_caption_names_what_is_over():
    figure = figure_of(np.exp(-60 * T), np.exp(-15 * T), np.sin(2 * T))
    assert -np.log(1 - MOST) / 60 < 0.05 < -np.log(1 - MOST) / 15 < FAST * 2.0
    assert split_of(figure).at == pytest.approx(0.05)
    assert "(of y0)" in with_room_for_transients([figure])[0].caption


def test_figures_that_are_seen_together_have_one_axis():
    fast, slow = figure_of(np.exp(-30 * T)), figure_of(np.sin(2 * T))
    phases = figure_of(np.exp(-90 * T), shares_time=False)
    shown = with_room_for_transients([fast, slow, phases])
    assert shown[2] is phases
    assert {panel.x.split for figure in shown[:2] for panel in figure.panels} == {split_of(fast)}
    assert "(of y0)" in shown[0].caption
    assert "as in the figures beside this one" in shown[1].caption


def test_errors_do_not_decide():
    panel = Panel(Axis("time t", "s"), Axis("energy residual |r|"), (Line(T, np.exp(-30 * T)),))
    errors = Figure("f", "F", (panel,), shares_time=True)
    assert with_room_for_transients([errors]) == [errors]
    shown = with_room_for_transients([errors, figure_of(np.exp(-30 * T))])
    assert shown[0].panels[0].x.split is not None


def test_a_run_that_ends_early_has_room():
    early = T[:15]
    marks = (Line(early, np.cos(90 * early), "early"), Line(T, np.sin(2 * T), "long"))
    panel = Panel(Axis("time t", "s"), Axis("y"), marks)
    split = split_of(Figure("f", "F", (panel,), shares_time=True))
    assert early[-1] <= split.at <= 2 * early[-1]


def test_stacks_count_as_their_parts():
    parts = np.column_stack([np.exp(-30 * T), 0.1 * np.sin(T)])
    panel = Panel(Axis("time t", "s"), Axis("y"), (Stack(T, parts, ("a", "b")),))
    assert split_of(Figure("f", "F", (panel,), shares_time=True)).at == pytest.approx(0.1)


def test_a_transient_that_samples_do_not_resolve_gets_a_part_of_several_samples():
    split = split_of(figure_of(np.exp(-3000 * T)))
    assert split.at >= T[MIN_SAMPLES]
    few = np.linspace(0.0, 2.0, 2 * MIN_SAMPLES)
    panel = Panel(Axis("time t", "s"), Axis("y"), (Line(few, np.exp(-3000 * few)),))
    figure = Figure("f", "F", (panel,), shares_time=True)
    assert with_room_for_transients([figure]) == [figure]


def test_figures_over_other_quantities_are_left_alone():
    figure = figure_of(np.exp(-30 * T), shares_time=False)
    assert with_room_for_transients([figure]) == [figure]
    only_points = Panel(Axis("time t", "s"), Axis("y"), (Points(T, T),))
    figure = Figure("f", "F", (only_points,), shares_time=True)
    assert with_room_for_transients([figure]) == [figure]


def test_a_border_case_is_fast_at_a_tenth_of_the_duration():
    # A ramp that ends at x, then rests: the share MOST of its change ends at MOST x.
    for end, is_split in ((0.9 * FAST * 2.0, True), (1.2 * FAST * 2.0, False)):
        ramp = np.minimum(T, end / MOST)
        assert (split_of(figure_of(ramp)) is not None) == is_split


@pytest.mark.parametrize("split", [SplitTime(0.0, 0.1, 2.0), SplitTime(-1.0, 3.0, 3.5)])
def test_places_are_linear_in_both_parts_and_invert(split):
    times = np.linspace(split.begin, split.end, 50)
    places = split.places(times)
    assert places[0] == pytest.approx(0.0)
    assert places[-1] == pytest.approx(1.0)
    assert split.places(np.array([split.at])) == pytest.approx(FIRST_SHARE)
    expected = np.interp(times, tuple(split), (0.0, FIRST_SHARE, 1.0))
    np.testing.assert_allclose(places, expected, atol=1e-12)
    np.testing.assert_allclose(split.times(places), times, atol=1e-12)
    # Beyond its ends the axis goes on with the same scales.
    outside = np.array([split.begin - 1, split.end + 1])
    np.testing.assert_allclose(split.times(split.places(outside)), outside)
