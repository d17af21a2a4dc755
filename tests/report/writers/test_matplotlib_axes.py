"""Protects the axes of drawings for paper: their ticks, labels and scales."""

import re
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from report.writers.matplotlib_drawings import PLAIN, X, Y, axes_of, figure_of, no_overlap
from support.figure_runs import run_of, without_config
from support.sections import figures_in

from rbstab.report.model.figure import (
    Axis,
    Bars,
    Figure,
    Line,
    Panel,
    Points,
)
from rbstab.report.model.split_time import SplitTime
from rbstab.report.runs.sections import run_sections
from rbstab.report.writers.matplotlib_figures.renderer import draw_figure


def test_axes_say_what_they_are_and_share_time():
    figure = figures_in(run_sections([without_config(run_of("permanent"))]))["run-1-states"]
    drawing = draw_figure(figure)
    labels = [axes.get_ylabel().replace("\n", " ") for axes in drawing.axes]
    assert labels == [panel.y.text.replace(" [", "\N{NO-BREAK SPACE}[") for panel in figure.panels]
    bottom = [axes.get_xlabel() for axes in drawing.axes]
    assert bottom == [""] * 4 + ["time t\N{NO-BREAK SPACE}[s]"] * 2
    assert len({axes.get_xlim() for axes in drawing.axes}) == 1


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.1, 10.0, ["0.1", "0.3", "1", "3", "10"]),
        (0.5, 9.0, ["1", "3"]),
        (1e-3, 10.0, ["10^{-3}", "10^{-1}", "10^{1}"]),
    ],
)
def test_labels_of_few_decades_are_written_out(low, high, expected):
    axis = Axis("factor", log=True, ends=(low, high))
    line = Line(np.array([low, high]), np.array([1.0, 2.0]))
    drawing = draw_figure(Figure("f", "F", (Panel(axis, Axis("y"), (line,)),) * 3, columns=3))
    drawing.draw_without_rendering()
    for axes in drawing.axes:
        every = axes.get_xticklabels(which="both")
        labels = [t for t in every if t.get_text() and low <= t.get_position()[0] <= 1.001 * high]
        labels.sort(key=lambda label: label.get_position()[0])
        assert [re.sub(r".*{(.*\{.*\})}.*", r"\1", t.get_text()) for t in labels] == expected
        boxes = [label.get_window_extent() for label in labels]
        assert all(one.x1 < other.x0 for one, other in pairwise(boxes))


def test_what_is_not_positive_is_left_out_of_a_logarithmic_axis():
    y = np.array([1.0, 0.0, -1.0, np.inf, 10.0])
    (line,) = axes_of(figure_of(Line(np.arange(5.0), y), y=Axis("y", log=True))).lines
    np.testing.assert_array_equal(line.get_ydata(), [1.0, np.nan, np.nan, np.nan, 10.0])


def test_a_unit_is_as_long_on_both_axes_where_it_should_be():
    axes = axes_of(figure_of(Line(X, 10 * Y), equal=True))
    assert axes.get_aspect() == 1.0
    assert axes_of(figure_of(Line(X, 10 * Y))).get_aspect() == "auto"


@pytest.mark.parametrize("columns", [1, 2, 3])
def test_words_as_ticks_stand_apart_and_inside(columns):
    words = ("free", "permanent", "visco-elastic", "embedded", "sliding")
    marks = (Points(np.arange(5.0), np.arange(5.0), "a"),)
    panel = Panel(Axis("variant", categories=words), PLAIN, marks)
    drawing = draw_figure(Figure("f", "F", (panel,) * 3, columns=columns))
    axes = drawing.axes[0]
    assert axes.get_xlim() == (-0.5, 4.5)
    labels = axes.get_xticklabels()
    assert [label.get_text() for label in labels] == list(words)
    # Slanted texts do not touch, although their boxes overlap.
    assert labels[0].get_rotation() or no_overlap(drawing, labels)


def test_long_categories_are_put_on_several_lines():
    words = ("completed", "completed, settled", "completed, |E| below 1 mm from some time on")
    axis = Axis("outcome", categories=words)
    drawing = draw_figure(figure_of(Points(np.arange(3.0), np.arange(3.0), "a"), x=axis))
    labels = drawing.axes[0].get_xticklabels()
    assert [" ".join(label.get_text().split()) for label in labels] == list(words)
    assert not any(label.get_rotation() for label in labels)
    assert no_overlap(drawing, labels)


def test_labels_of_low_panels_are_not_longer_than_their_axes():
    panel = Panel(Axis("x"), Axis("share of members"), (Line(X, Y, "a"),))
    drawing = draw_figure(Figure("f", "F", (panel,) * 8, columns=2))
    FigureCanvasAgg(drawing).draw()
    for axes in drawing.axes:
        assert axes.yaxis.label.get_window_extent().height <= axes.get_window_extent().height


@pytest.mark.parametrize("begin", [0.6, 0.8, 1.0, 2.1, 4.1, 7.0])
@pytest.mark.parametrize("span", [1.4, 1.6, 2.4, 2.6, 4.8, 9.0, 30.0])
def test_labels_of_a_short_logarithmic_axis_of_x_do_not_overlap(begin, span):
    low, high = 1e-14 * begin, 1e-14 * begin * span
    panel = Panel(Axis("r", log=True), PLAIN, (Line(np.array([low, high]), np.ones(2)),))
    drawing = draw_figure(Figure("f", "F", (panel,) * 8, columns=2))
    axis = drawing.axes[0].xaxis
    FigureCanvasAgg(drawing).draw()
    ends = axis.get_view_interval()
    labels = [
        label
        for label in axis.get_ticklabels(which="both")
        if label.get_text() and ends[0] <= label.get_position()[0] <= ends[1]
    ]
    assert labels
    assert no_overlap(drawing, labels)


def test_a_split_time_axis_has_two_scales_and_ticks_of_both():
    t = np.linspace(0.0, 2.0, 201)
    x = Axis("time t", "s", split=SplitTime(0.0, 0.1, 2.0))
    drawing = draw_figure(
        Figure("f", "F", (Panel(x, PLAIN, (Line(t, np.exp(-30 * t)),)),), shares_time=True)
    )
    axes = drawing.axes[0]
    to_axes = axes.transData + axes.transAxes.inverted()
    places = to_axes.transform([(time, 0.5) for time in (0.0, 0.05, 0.1, 1.05, 2.0)])[:, 0]
    np.testing.assert_allclose(places, [0.0, 0.2, 0.4, 0.7, 1.0], atol=1e-9)
    ticks = axes.get_xticks()
    assert {0.0, 0.05, 0.1, 2.0} <= {round(tick, 9) for tick in ticks}
    drawing.draw_without_rendering()
    labels = [label for label in axes.get_xticklabels() if label.get_text()]
    boxes = [label.get_window_extent() for label in labels]
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))


def test_labels_of_a_short_logarithmic_axis_do_not_overlap():
    """Over 1.4 decades matplotlib itself labels 2, 3, 4 and 6 times each power of ten."""
    line = Line(np.array([0.0, 1.0]), np.array([2e-4, 4.6e-3]))
    logged = Panel(Axis("t"), Axis("v", log=True), (line,))
    drawing = draw_figure(Figure("f", "F", (logged,) * 6, columns=2))
    canvas = FigureCanvasAgg(drawing)
    canvas.draw()
    axis = drawing.axes[0].yaxis
    labels = [label for label in axis.get_ticklabels(which="both") if label.get_text()]
    low, high = axis.get_view_interval()
    boxes = sorted(
        (box.y0, box.y1)
        for label in labels
        if low <= label.get_position()[1] <= high
        for box in [label.get_window_extent(canvas.get_renderer())]
    )
    assert len(boxes) >= 3
    assert all(below[1] <= above[0] for below, above in pairwise(boxes))


@pytest.mark.parametrize("most", [0.0, 1.0, 2.0, 3.0, 40.0])
def test_an_axis_that_counts_has_ticks_at_whole_numbers(most):
    bars = Bars(np.arange(4.0), np.array([most / 2 // 1, most, 0.0]))
    axes = axes_of(figure_of(bars, y=Axis("members", whole=True)))
    assert all(tick.is_integer() for tick in axes.get_yticks())
    if most == 1.0:
        assert not all(tick.is_integer() for tick in axes_of(figure_of(bars)).get_yticks())


def test_a_row_of_small_panels_has_one_title():
    line = Line(X, Y)
    names = ["a long name of a parameter"] * 3 + ["other", "another", "a third"]
    panels = tuple(Panel(Axis(name), Axis("y"), (line,)) for name in names)
    drawing = draw_figure(Figure("f", "F", panels, columns=3, shared="y", small=True))
    labels = [axes.get_xlabel().replace("\n", " ") for axes in drawing.axes]
    assert labels == ["", names[0], "", *names[3:]]
