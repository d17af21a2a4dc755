"""Protects the figures drawn by matplotlib: marks, legends, axes, maps, and texts of any kind."""

import subprocess
import sys
from dataclasses import replace
from io import BytesIO
from typing import Any, get_args

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure as Drawing
from PIL import Image
from report.writers.matplotlib_drawings import (
    PLAIN,
    X,
    Y,
    axes_of,
    figure_of,
    no_overlap,
    tight_box_of,
)
from support.figure_runs import lines_of, run_of, without_config
from support.sections import figures_in

from rbstab.report.model.figure import (
    Axis,
    Band,
    Bars,
    CellMembers,
    Cells,
    Figure,
    Intervals,
    Level,
    Line,
    Mark,
    Panel,
    Points,
    Shares,
    Stack,
)
from rbstab.report.model.palette import COLOURS, colour
from rbstab.report.runs.sections import run_sections
from rbstab.report.writers.matplotlib_figures.renderer import draw_figure, png

HOSTILE = [r"$\frac$", "_hidden", "a_b^c", "100 % {x} \\n", "$x$ and $y$", "<b>", r"\$5", "中文"]


def legend_of(drawing):
    return [text.get_text() for legend in drawing.legends for text in legend.get_texts()]


def image_of(figure, dpi=60):
    return np.asarray(Image.open(BytesIO(png(figure, dpi=dpi))).convert("RGB"))


SIGNATURES = {
    Line: Line(X, Y, "line"),
    Points: Points(X, Y, "points", symbol=3),
    Stack: Stack(X, np.column_stack([Y, -X, X]), ("a", "b", "c")),
    Bars: Bars(X, np.arange(6.0), "bars"),
    Intervals: Intervals(X, Y, Y - 0.1, Y + 0.2, "intervals"),
    Band: Band(X, Y + 1.0, Y + 2.0, "band"),
    Cells: Cells(X, X, np.outer(X, X), Axis("product", "J")),
    Level: Level(0.7, "level"),
    Shares: Shares(np.array([[1, 2, 3], [4, 0, 900]]), ("a", "b", "c"), (0, 1, 2)),
}


def test_there_is_an_example_of_each_mark():
    assert set(SIGNATURES) == set(get_args(Mark))


@pytest.mark.parametrize("kind", SIGNATURES.values(), ids=lambda mark: type(mark).__name__)
@pytest.mark.parametrize("log", [False, True], ids=["linear", "log"])
def test_each_mark_is_seen(kind, log):
    axis = Axis("q", "J", log=log)
    bare = image_of(figure_of(Level(0.6), Level(1.9), x=axis, y=axis))
    shown = figure_of(kind, Level(0.6), Level(1.9), x=axis, y=axis)
    assert bare.shape != image_of(shown).shape or (bare != image_of(shown)).any()
    image = image_of(shown)
    spread = image.max(axis=2).astype(int) - image.min(axis=2)
    assert (spread > 40).sum() > 20 or isinstance(kind, Level)


@pytest.mark.parametrize("kind", SIGNATURES.values(), ids=lambda mark: type(mark).__name__)
def test_labels_stand_in_the_legend(kind):
    drawing = draw_figure(figure_of(kind))
    labels = {"Stack": ["a", "b", "c"], "Shares": ["a", "b", "c"], "Cells": []}
    expected = labels.get(type(kind).__name__) or [getattr(kind, "label", "")]
    assert legend_of(drawing) == [label for label in expected if label]


def test_a_part_of_a_bar_has_its_count_where_there_is_room():
    axes = axes_of(figure_of(SIGNATURES[Shares], y=Axis("", categories=("low", "high"))))
    widths = [patch.get_width() for patch in axes.patches]
    assert widths == pytest.approx([1 / 6, 4 / 904, 2 / 6, 0, 3 / 6, 900 / 904])
    places = {text.get_text(): text.get_position() for text in axes.texts}
    # 4 of 904 is too narrow for its digit; the others are in the middle of their parts.
    assert set(places) == {"1", "2", "3", "900"}
    assert places["2"] == pytest.approx((1 / 6 + 1 / 6, 0))
    assert places["900"] == pytest.approx((4 / 904 + 450 / 904, 1))


def test_curves_of_runs_are_drawn_as_they_are_stored():
    runs = [without_config(run_of(kind, n)) for n, kind in enumerate(("permanent", "free"))]
    figure = figures_in(run_sections(runs))["runs-decay"]
    drawing = draw_figure(figure)
    assert legend_of(drawing) == ["permanent", "free"]
    for axes, panel in zip(drawing.axes, figure.panels, strict=True):
        assert axes.get_yscale() == ("log" if panel.y.log else "linear")
        for line, mark, run in zip(axes.lines, lines_of(panel), runs, strict=True):
            assert to_hex(line.get_color()).upper() == colour(run.number)
            y = np.asarray(line.get_ydata())
            shown = np.isfinite(y)
            np.testing.assert_array_equal(y[shown], mark.y[shown])
            assert shown.all() or panel.y.log
            assert (mark.y[~shown] <= 0).all()
            np.testing.assert_array_equal(line.get_xdata(), run.result["time"])


def test_a_label_stands_once_in_the_legend_and_levels_come_last():
    marks = (Level(1.0, "limit"), Line(X, Y, "a"), Line(X, -Y, "a"), Points(X, Y, "b"))
    panel = Panel(Axis("x"), Axis("y"), marks)
    drawing = draw_figure(Figure("f", "F", (panel, panel), columns=2))
    assert legend_of(drawing) == ["a", "b", "limit"]


@pytest.mark.parametrize("count", [1, 5, 24])
def test_the_legend_covers_no_data(count):
    marks = tuple(Line(X, n * Y, f"a run of a long name, number {n}", n) for n in range(count))
    drawing = draw_figure(figure_of(*marks))
    drawing.draw_without_rendering()
    (legend,) = drawing.legends
    box = legend.get_window_extent()
    whole = drawing.bbox
    assert box.x0 >= whole.x0
    assert box.x1 <= whole.x1
    assert box.y1 <= whole.y1
    assert all(tight_box_of(axes).y1 <= box.y0 for axes in drawing.axes)
    height = drawing.axes[0].get_window_extent().height / drawing.dpi
    assert height > 1.5


def test_panels_do_not_overlap():
    run = without_config(run_of("sliding"))
    for figure in figures_in(run_sections([run])).values():
        drawing = draw_figure(figure)
        drawing.draw_without_rendering()
        boxes = [tight_box_of(axes) for axes in drawing.axes]
        for number, box in enumerate(boxes):
            assert not any(box.overlaps(other) for other in boxes[:number]), figure.name


def width_of(text, **options):
    drawing = Drawing(dpi=100)
    FigureCanvasAgg(drawing)
    return drawing.text(0, 0, text, **options).get_window_extent().width


@pytest.mark.parametrize("label", HOSTILE[:-1])
def test_labels_are_drawn_letter_by_letter(label):
    drawing = draw_figure(figure_of(Line(X, Y, label), x=Axis(label), y=Axis(label), title=label))
    drawing.draw_without_rendering()
    axes = drawing.axes[0]
    (entry,) = drawing.legends[0].get_texts()
    for text in (entry, axes.title, axes.xaxis.label):
        plain = width_of(label, parse_math=False, size=text.get_fontsize(), font="DejaVu Sans")
        assert text.get_window_extent().width == pytest.approx(plain, abs=1.5)


@pytest.mark.parametrize("label", HOSTILE)
def test_any_label_can_be_drawn(label):
    scale = Axis(label, "J")
    marks = (Line(X, Y, label), Stack(X, X[:, None], (label,)), Cells(X, X, np.eye(7), scale))
    for mark in marks:
        image_of(figure_of(mark, x=Axis(label, categories=(label,)), y=Axis(label, label)))
    words = replace(scale, categories=(label, "other"))
    assert legend_of(draw_figure(figure_of(Cells(X, X, np.eye(7), words))))[1] == "other"


def test_words_stand_at_their_places():
    axis = Axis("variant", categories=("free", "held", "tied"))
    axes = axes_of(figure_of(Points(np.arange(3.0), np.ones(3)), x=axis))
    assert [label.get_text() for label in axes.get_xticklabels()] == list(axis.categories)
    assert axes.get_xticks().tolist() == [0, 1, 2]


def test_more_parts_than_colours_are_told_apart():
    count = len(COLOURS) + 2
    stack = Stack(np.arange(3.0), np.ones((3, count)), tuple("abcdefghi"[:count]))
    fills = {to_hex(p.get_facecolor()[0]) for p in axes_of(figure_of(stack)).collections}
    assert len(fills) == count


def test_parts_are_stacked_upwards_and_downwards():
    up, down, more = np.full(3, 2.0), np.full(3, -1.0), np.full(3, 3.0)
    stack = Stack(np.arange(3.0), np.column_stack([up, down, more]), ("up", "down", "more"))
    axes = axes_of(figure_of(stack))
    spans = {}
    for patch in axes.collections:
        y = patch.get_paths()[0].vertices[:, 1]
        if np.ptp(y):
            spans[to_hex(patch.get_facecolor()[0])] = (y.min(), y.max())
    assert spans == {
        colour(0).lower(): (0.0, 2.0),
        colour(1).lower(): (-1.0, 0.0),
        colour(2).lower(): (2.0, 5.0),
    }


def test_a_map_of_words_has_a_colour_for_each():
    values = np.array([[0.0, 1.0], [np.nan, 2.0]])
    cells = Cells(X[:2], X[:2], values, Axis("status", categories=("good", "bad", "odd", "never")))
    drawing = draw_figure(figure_of(cells))
    (mesh,) = drawing.axes[0].collections
    array = mesh.get_array()
    assert array is not None
    found = mesh.to_rgba(array)[~np.isnan(values)]
    np.testing.assert_allclose(found, [to_rgba(colour(number)) for number in range(3)])
    assert legend_of(drawing) == ["good", "bad", "odd"]
    assert len(drawing.axes) == 1


@pytest.mark.parametrize("log", [False, True])
def test_a_map_of_numbers_has_a_bar_that_says_what_they_are(log):
    cells = Cells(X[:3], X[:2], np.array([[1.0, 2, 3], [10, np.nan, 1000]]), Axis("v", "J", log))
    drawing = draw_figure(figure_of(cells))
    _, bar = drawing.axes
    assert bar.get_ylabel() == ("v [J], logarithmic" if log else "v [J]")
    assert bar.get_yscale() == ("log" if log else "linear")
    assert bar.get_ylim() == pytest.approx((1.0, 1000.0))


@pytest.mark.parametrize("log", [False, True])
def test_cells_meet_between_their_middles(log):
    middles = np.array([1.0, 10.0, 100.0]) if log else np.array([1.0, 2.0, 5.0])
    cells = Cells(middles, np.array([3.0]), np.ones((1, 3)), Axis("v"))
    (mesh,) = axes_of(figure_of(cells, x=Axis("x", log=log))).collections
    edges = mesh.get_coordinates()[0, :, 0]
    expected = 10.0 ** np.array([-0.5, 0.5, 1.5, 2.5]) if log else [0.5, 1.5, 3.5, 6.5]
    np.testing.assert_allclose(np.ma.getdata(edges), expected)


@pytest.mark.parametrize("value", [np.nan, 0.0, 7.0, -1e300])
@pytest.mark.parametrize("log", [False, True])
@pytest.mark.parametrize("words", [(), ("a", "b")])
def test_maps_of_one_value_or_none(value, log, words):
    cells = Cells(
        X[:2], X[:1], np.full((1, 2), value), Axis("v", log=log and not words, categories=words)
    )
    image_of(figure_of(cells))


def test_error_bars_reach_their_ends():
    low, high = np.array([0.5, 0.0]), np.array([2.0, 3.0])
    intervals = Intervals(np.arange(2.0), np.ones(2), low, high, "i")
    for log, ends in ((False, [(0.5, 2.0), (0.0, 3.0)]), (True, [(0.5, 2.0), (1.0, 3.0)])):
        axes = axes_of(figure_of(intervals, y=Axis("y", log=log)))
        bars = axes.collections[0].get_segments()
        assert [(bar[0, 1], bar[1, 1]) for bar in bars] == ends


@pytest.mark.parametrize("most", [0.48, 0.05, 6e3, 1e9])
def test_a_logarithmic_bar_has_ticks_that_can_be_read(most):
    x = np.arange(3.0)
    cells = Cells(x, x[:2], np.geomspace(0.012, most, 6).reshape(2, 3), Axis("E", "m", log=True))
    panel = Panel(PLAIN, PLAIN, (cells,), "a map")
    drawing = draw_figure(Figure("f", "F", (panel,) * 5, columns=2))
    bars = [axes for axes in drawing.axes if axes.get_ylabel() == "E [m], logarithmic"]
    assert len(bars) == 5
    FigureCanvasAgg(drawing).draw()
    low, high = bars[0].get_ylim()
    ticks = [t for t in bars[0].yaxis.get_major_ticks() if low <= t.get_loc() <= high]
    ticks += [t for t in bars[0].yaxis.get_minor_ticks() if t.label2.get_text()]
    assert all(tick.label2.get_text() for tick in ticks)
    assert len(ticks) > 1
    assert no_overlap(drawing, [tick.label2 for tick in ticks])


def test_maps_are_no_bands():
    cells = Cells(X[:3], X[:2], np.ones((2, 3)), Axis("E", "m"))
    drawing = draw_figure(Figure("f", "F", (Panel(PLAIN, PLAIN, (cells,)),) * 5, columns=2))
    FigureCanvasAgg(drawing).draw()
    box = drawing.axes[0].get_window_extent()
    assert box.height > 0.4 * box.width


def test_points_at_the_ends_are_whole():
    share = Axis("share", ends=(-0.03, 1.03))
    one = np.array([1.0])
    drawing = draw_figure(figure_of(Intervals(one, one, 0.9 * one, one), y=share))
    (middle,) = [line for line in drawing.axes[0].lines if line.get_marker() == "o"]
    assert not middle.get_clip_on()
    axes = axes_of(figure_of(Points(np.array([0.0, 1.0]), np.array([0.0, 1.0]), "eigenvalues")))
    low, high = axes.get_xlim()
    assert -low >= 0.045
    assert high - 1 >= 0.045


def test_a_figure_is_as_wide_as_a_page_and_no_taller():
    panel = Panel(Axis("x"), Axis("y"), (Line(X, Y, "a"),))
    for count, columns in ((1, 1), (3, 1), (6, 2), (8, 3), (20, 2)):
        drawing = draw_figure(Figure("f", "F", (panel,) * count, columns=columns))
        width, height = drawing.get_size_inches()
        assert width * 25.4 == pytest.approx(170, abs=1)
        assert height * 25.4 < 250
    image = image_of(Figure("f", "F", (panel,)), dpi=100)
    assert image.shape[1] == 670


def test_a_figure_without_panels_or_marks():
    assert image_of(Figure("f", "F", ())).size
    assert image_of(figure_of()).size
    assert image_of(figure_of(y=Axis("y", log=True))).size


def test_settings_neither_leave_nor_enter():
    figure = figure_of(Line(X, Y, "a"), Stack(X, X[:, None], ("b",)), y=Axis("y", log=True))
    expected, before = png(figure, dpi=50), dict(mpl.rcParams)
    user_settings: dict[Any, Any] = {
        "font.size": 30,
        "axes.grid": False,
        "axes.facecolor": "red",
        "lines.marker": "x",
    }
    with mpl.rc_context(user_settings):
        changed = dict(mpl.rcParams)
        assert png(figure, dpi=50) == expected
        draw_figure(figure)
        assert dict(mpl.rcParams) == changed
    assert dict(mpl.rcParams) == before


def test_pyplot_is_not_imported():
    code = (
        "import sys, numpy as np\n"
        "from rbstab.report.model.figure import *\n"
        "from rbstab.report.writers.matplotlib_figures.renderer import png\n"
        "x = np.arange(3.0)\n"
        "png(Figure('f', 'F', (Panel(Axis('x'), Axis('y'), (Line(x, x, 'a'),)),)))\n"
        "print('matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_cells_without_a_value_and_words_stand_in_the_legend():
    members = CellMembers(np.ones((1, 3), int), np.zeros((1, 3), int), "", np.array([[-1, 0, 1]]))
    members = replace(members, reasons=("not settled", "range left"))
    cells = Cells(np.arange(3.0), np.arange(1.0), np.array([[1.0, np.nan, np.nan]]), Axis("z"))
    drawing = draw_figure(figure_of(replace(cells, members=members)))
    assert legend_of(drawing) == ["no value: not settled", "no value: range left"]


def test_marks_on_a_map_do_not_widen_it():
    cells = Cells(np.array([0.0, 1.0]), np.array([0.0, 2.0]), np.eye(2), Axis("z"))
    axes = axes_of(figure_of(cells, Points(np.array([1.0]), np.array([2.0]), "largest")))
    assert (axes.get_xlim(), axes.get_ylim()) == ((-0.5, 1.5), (-1.0, 3.0))


def test_a_curve_of_which_nothing_is_drawn_is_not_in_the_legend():
    zeros = Line(X, np.zeros(7), "nothing")
    drawing = draw_figure(figure_of(Line(X, X, "energy"), zeros, y=Axis("e", "J", log=True)))
    assert legend_of(drawing) == ["energy"]


def test_a_curve_behind_others_is_wider_and_paler():
    axes = axes_of(figure_of(Line(X, Y, "behind", depth=1), Line(X, -Y, "before")))
    behind, before = axes.lines
    assert behind.get_zorder() < before.get_zorder()
    assert behind.get_alpha() < before.get_alpha() == 1.0
    assert behind.get_linewidth() > before.get_linewidth()


def test_a_figure_for_a_column_has_its_panels_below_each_other_and_nothing_is_cut():
    label = "a run with a long name, longer than a column of a paper is wide"
    panels = tuple(
        Panel(Axis("time t", "s"), Axis("a quantity with a long name", "kg m²/s²"), (line,))
        for line in (Line(X, Y, label), Line(X, 2 * Y, "short"))
    )
    drawing = draw_figure(Figure("f", "F", panels, columns=2), column=True)
    first, second = drawing.axes
    drawing.draw_without_rendering()
    assert drawing.get_figwidth() == pytest.approx(80 / 25.4)
    assert first.get_position().y0 > second.get_position().y1
    assert first.get_position().width > 0.5
    box = drawing.get_tightbbox()
    assert box.x0 >= -0.01
    assert box.x1 <= drawing.get_figwidth() + 0.01
    assert " ".join(legend_of(drawing)[0].split()) == label
