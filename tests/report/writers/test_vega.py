"""Protects figures as Vega-Lite: what is drawn, where, and in which colour."""

import base64
import json
import math
import re
from dataclasses import replace
from io import BytesIO
from typing import Any

import numpy as np
import pytest
import vl_convert
from matplotlib import colormaps
from PIL import Image
from support.pages import figures

from rbstab.report.model.figure import (
    Axis,
    Band,
    CellMembers,
    Cells,
    Figure,
    Level,
    Line,
    Panel,
    Points,
    Shares,
    Stack,
)
from rbstab.report.model.palette import colour
from rbstab.report.writers.figure_files import figure_bytes
from rbstab.report.writers.vega.cells import edges_of, picture, tints_of
from rbstab.report.writers.vega.legend import legend_of
from rbstab.report.writers.vega.page_data import page_data
from rbstab.report.writers.vega.specification import specification

PLAIN = Axis("quantity")
T = np.array([0.0, 1.0, 2.0, 4.0])


def figure_of(*marks, x=PLAIN, y=PLAIN, **options):
    return Figure("f", "F", (Panel(x, y, marks),), **options)


def layers_of(figure):
    layers: list[dict[str, Any]] = specification(figure, width=475.0, for_page=True)["concat"][0][
        "layer"
    ]
    return layers


def ends_of(figure):
    """Return the ends of the axes x and y of each panel."""
    panels = specification(figure, width=475.0, for_page=True)["concat"]
    places = [panel["layer"][0]["encoding"] for panel in panels]
    return [{side: tuple(at[side]["scale"]["domain"]) for side in ("x", "y")} for at in places]


def drawn(figure):
    """Return the marks that Vega draws, with their items in pixels."""
    scene = vl_convert.vegalite_to_scenegraph(json.dumps(specification(figure, width=475.0)))
    marks: list[dict[str, Any]] = []

    def walk(node):
        if node.get("role") == "mark":
            marks.append(node)
        for item in node.get("items", []):
            if isinstance(item, dict):
                walk(item)

    walk(scene["scenegraph"])
    return marks


def places(figure, kind):
    marks = [mark for mark in drawn(figure) if mark["marktype"] == kind]
    return [[(item.get("x", 0), item.get("y", 0)) for item in mark["items"]] for mark in marks]


def test_a_curve_is_where_its_axes_say():
    x, y = Axis("x", ends=(0.0, 4.0)), Axis("y", ends=(0.0, 10.0))
    (points,) = places(figure_of(Line(T, T**2 / 2), x=x, y=y), "line")
    # A panel of one row is 400 px wide and 240 px high.
    assert points == [pytest.approx((100 * t, 240 - 24 * t**2 / 2)) for t in T]


def test_a_logarithmic_axis_shows_logarithms_and_nothing_at_or_below_zero():
    y = Axis("y", log=True, ends=(1e-4, 1.0))
    line = Points(T, np.array([1.0, 0.0, -1.0, 1e-2]))
    rows = layers_of(figure_of(line, y=y))[0]["data"]["values"]
    assert [row["y"] for row in rows] == [1.0, None, None, 1e-2]
    (points,) = places(figure_of(Points(T[[0, 3]], line.y[[0, 3]]), y=y), "symbol")
    assert [place[1] for place in points] == pytest.approx([0.0, 120.0])


def test_a_gap_stays_a_gap():
    (mark,) = [
        m for m in drawn(figure_of(Line(T, np.array([0, 1, np.nan, 3])))) if m["marktype"] == "line"
    ]
    assert [item.get("defined", True) for item in mark["items"]] == [True, True, False, True]


def test_every_kind_of_mark_is_drawn_in_every_form():
    for figure in figures():
        assert b"<svg" in figure_bytes(figure, "svg")[:100]
    for form, begin in (("pdf", b"%PDF"), ("png", b"\x89PNG")):
        assert figure_bytes(figures()[0], form).startswith(begin)


def test_a_column_is_narrower_and_has_its_panels_below_each_other():
    figure = figures()[0]
    sizes = []
    for column in (False, True):
        image = Image.open(BytesIO(figure_bytes(figure, "png", column=column)))
        sizes.append(image.size)
    # 170 and 80 mm at 300 dots per inch.
    assert sizes[0][0] == pytest.approx(170 / 25.4 * 300, abs=3)
    assert sizes[1][0] == pytest.approx(80 / 25.4 * 300, abs=3)
    assert sizes[1][1] > 1.3 * sizes[0][1]


def test_a_stack_adds_up_and_what_is_negative_goes_down():
    parts = np.array([[1.0, -2.0, 3.0], [-4.0, 5.0, -6.0]])
    layers = layers_of(figure_of(Stack(T[:2], parts, ("a", "b", "c"))))
    ends = [[(row["low"], row["high"]) for row in layer["data"]["values"]] for layer in layers]
    assert ends == [[(0, 1), (0, -4)], [(0, -2), (0, 5)], [(1, 4), (-4, -10)]]
    low, high = ends_of(figure_of(Stack(T[:2], parts, ("a", "b", "c"))))[0]["y"]
    assert low < -10 < 5 < high


def test_shares_fill_a_bar_and_name_their_counts():
    mark = Shares(np.array([[3, 1], [0, 5]]), ("good", "bad"), (0, 1))
    figure = figure_of(
        mark, y=Axis("", categories=("second", "first")), x=Axis("share", ends=(0, 1))
    )
    bars = [m for m in drawn(figure) if m["marktype"] == "rect"]
    widths = [[item["width"] for item in mark["items"]] for mark in bars]
    assert widths == [pytest.approx([300, 0]), pytest.approx([100, 400])]
    texts = [i["text"] for m in drawn(figure) if m["marktype"] == "text" for i in m["items"]]
    assert sorted(texts) == ["1", "3", "5"]


def test_bands_and_levels_have_both_ends():
    marks = Band(T[:2], T[:2], T[:2] + 1, "b"), Level(0.5, "l"), Level(1.5, "v", vertical=True)
    rows = [layer["data"]["values"][0] for layer in layers_of(figure_of(*marks))]
    assert rows == [
        {"series": "b", "x": 0, "low": 0, "high": 1},
        {"series": "l", "y": 0.5},
        {"series": "v", "x": 1.5},
    ]


def pixels(cells, x=PLAIN, y=PLAIN):
    """Return the picture of a map as an array of red, green, blue and opacity."""
    data = base64.b64decode(picture(cells, x, y).split(",")[1])
    return np.array(Image.open(BytesIO(data)).convert("RGBA"))


LOG = Axis("z", log=True)


@pytest.mark.parametrize(
    ("values", "scale", "span", "shares"),
    [
        # The lowest row is below.
        ([[0.0, 1.0, 2.0], [np.nan, 3.0, 4.0]], PLAIN, None, [[-1, 0.75, 1], [0, 0.25, 0.5]]),
        ([[1e-6, 1e-3, 1.0, 0.0]], LOG, None, [[0, 0.5, 1, -1]]),
        ([[0.0, np.nan]], LOG, None, [[-1, -1]]),
        ([[0.0, np.nan]], LOG, (0.0, 1.0), [[-1, -1]]),
        ([[1.0, 9.0]], PLAIN, (0.0, 2.0), [[0.5, 1]]),
    ],
    ids=["values", "logarithms", "none is positive", "none in the span", "beyond the span"],
)
def test_a_map_has_the_colour_of_each_value(values, scale, span, shares):
    """Shares of the scale; below zero, the cell has no value and is clear."""
    rows, columns = np.shape(values)
    cells = Cells(np.arange(float(columns)), np.arange(float(rows)), np.array(values), scale, span)
    colours, expected = pixels(cells) / 255, colormaps["viridis"](np.array(shares, dtype=float))
    shown = np.array(shares) >= 0
    assert (colours[..., 3] == shown).all()
    np.testing.assert_allclose(colours[shown], expected[shown], atol=0.03)


def test_colours_diverge_from_the_middle_where_values_are_on_both_sides():
    values = np.array([[-1.0, 0.0, 3.0]])
    cells = Cells(np.arange(3.0), np.zeros(1), values, Axis("z", middle=0.0))
    colours = pixels(cells)[0, :, :3].astype(int)
    assert colours[1].min() > 235
    assert colours[2, 1] < 80
    # Three times as far on the other side: this side has a third of its colours.
    assert colours[0].min() > 150
    above = replace(cells, values=np.abs(values) + 1)
    assert tints_of(above)[0] == "#440154"


def test_cells_of_unequal_widths_are_as_wide_as_they_are():
    x = np.array([0.0, 1.0, 4.0])
    assert edges_of(x, PLAIN) == pytest.approx([-0.5, 0.5, 2.5, 5.5])
    colours = pixels(Cells(x, np.zeros(1), np.array([[0.0, 1.0, 2.0]]), Axis("z")))[0]
    changes = np.flatnonzero(np.any(colours[1:] != colours[:-1], axis=1)) + 1
    assert changes / len(colours) == pytest.approx([1 / 6, 3 / 6], abs=2e-3)
    log = Axis("x", log=True)
    assert edges_of(np.array([1.0, 100.0]), log) == pytest.approx([0.1, 10.0, 1000.0])


def test_categories_have_their_colours():
    scale = Axis("answer", categories=("a", "b"), colours=(3, 5))
    row = pixels(Cells(np.arange(3.0), np.zeros(1), np.array([[1.0, 0.0, np.nan]]), scale))[0]
    expected = [list(bytes.fromhex(colour(n)[1:])) for n in (5, 3)]
    assert row[:2, :3].tolist() == expected
    assert row[2, 3] == 0


def test_axes_end_where_they_are_told_or_where_the_data_end():
    told = ends_of(figure_of(Line(T, T), x=Axis("x", ends=(-1.0, 9.0))))[0]
    assert told["x"] == (-1.0, 9.0)
    assert -0.5 < told["y"][0] < 0
    assert 4 < told["y"][1] < 4.5
    for values in (np.zeros(4), np.full(4, 7.0), np.full(4, np.nan), np.full(4, 1e300)):
        low, high = ends_of(figure_of(Line(T, values)))[0]["y"]
        assert low < high
        assert math.isfinite(low + high)


def test_axes_hold_the_ends_of_bands():
    low, high = -3.0 * T - 1, 5.0 * T + 1
    ends = ends_of(figure_of(Band(T, low, high)))[0]["y"]
    assert ends[0] < low.min() < high.max() < ends[1]


def test_panels_share_their_axes():
    small, large = (Panel(PLAIN, PLAIN, (Line(T, factor * T),)) for factor in (1, 10))
    figure = Figure("f", "F", (small, large), 2)
    assert ends_of(figure)[0]["y"][1] < 5
    shared = ends_of(replace(figure, shared="y"))
    assert shared[0]["y"] == shared[1]["y"]
    assert shared[0]["y"][1] > 40
    late = Panel(PLAIN, PLAIN, (Line(T + 3, T),))
    assert ends_of(Figure("f", "F", (small, late), shares_time=True))[0]["x"] == (0.0, 7.0)


def test_the_legend_names_each_curve_once_and_the_many_last():
    many = [Line(T, T, f"run {k}", colour=6, group="the others") for k in range(3)]
    curves = (Line(T, T, "first", colour=2, dash=1), Points(T, T, "ends", symbol=2), Line(T, T))
    panel = Panel(PLAIN, PLAIN, (*many, *curves))
    entries = legend_of(Figure("f", "F", (panel, panel)))
    assert [entry["label"] for entry in entries] == ["first", "ends", "the others"]
    assert entries[0] == {
        "of": "",
        "label": "first",
        "colour": colour(2),
        "kind": "line",
        "dash": [6, 4],
        "symbol": 0,
    }
    svg = figure_bytes(Figure("f", "F", (panel, panel)), "svg").decode()
    assert svg.count(">the others<") == 1


def test_the_legend_says_why_cells_have_no_value():
    members = CellMembers(
        np.ones((1, 2), int), np.array([[4, 5]]), "", np.array([[-1, 1]]), ("late", "lost")
    )
    cells = Cells(
        np.arange(2.0), np.zeros(1), np.array([[1.0, np.nan]]), Axis("z"), members=members
    )
    (entry,) = legend_of(figure_of(cells))
    assert (entry["label"], entry["kind"]) == ("no value: lost", "gap")


def test_maps_with_other_words_have_legends_of_their_own():
    """One colour is two words here: each stands under the name of its map, also in a file."""
    scales = (
        Axis("outcome", categories=("returns", "fails"), colours=(3, 5)),
        Axis("proof", categories=("proved", "fails"), colours=(3, 2)),
    )
    maps = [Cells(np.arange(2.0), np.zeros(1), np.array([[0.0, 1.0]]), scale) for scale in scales]
    figure = Figure("f", "F", tuple(Panel(PLAIN, PLAIN, (cells,)) for cells in maps))
    expected = [("outcome", "returns", 3), ("outcome", "fails", 5)]
    expected += [("proof", "proved", 3), ("proof", "fails", 2)]
    entries = legend_of(figure)
    shown = [(entry["of"], entry["label"], entry["colour"]) for entry in entries]
    assert shown == [(of, label, colour(number)) for of, label, number in expected]
    svg = figure_bytes(figure, "svg").decode()
    for word, count in (("outcome", 1), ("proof", 1), ("returns", 1), ("fails", 2)):
        assert svg.count(f">{word}<") == count
    assert {colour(number).lower() for number in (3, 5, 2)} <= set(
        re.findall(r"#\w{6}", svg.lower())
    )
    # Slices of one quantity have one legend.
    alike = replace(figure, panels=(figure.panels[0], replace(figure.panels[0], title="other")))
    assert [entry["of"] for entry in legend_of(alike)] == ["", ""]


def test_a_specification_is_valid_json_whatever_the_values():
    line = Line(T, np.array([np.inf, -np.inf, 1e308, -1e308]), "l")
    json.dumps(specification(figure_of(line), width=475.0), allow_nan=False)
    json.dumps(page_data(figure_of(line)), allow_nan=False)
