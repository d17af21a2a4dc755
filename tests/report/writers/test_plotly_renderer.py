"""Protects the figures drawn by plotly: valid keys, curves, maps, legends, and any texts."""

from dataclasses import replace
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
from report.writers.plotly_drawings import PLAIN, drawing_of, unpacked
from support.compared_maps import compared_maps
from support.pages import HOSTILE, figures

from rbstab.report.model.figure import (
    Axis,
    Band,
    Bars,
    CellMembers,
    Cells,
    Figure,
    Level,
    Line,
    Panel,
    Points,
    Stack,
)
from rbstab.report.model.palette import COLOURS, colour
from rbstab.report.writers.plotly_figures.page_data import page_data
from rbstab.report.writers.plotly_figures.renderer import plotly_data
from rbstab.report.writers.plotly_figures.text import packed_array, packed_integers


@pytest.mark.parametrize("figure", figures(), ids=lambda figure: figure.name)
def test_plotly_knows_every_word_of_it(figure: Figure) -> None:
    found = plotly_data(figure)
    for layout in (found["layout"], found["narrow"]):
        go.Figure(data=found["data"], layout=layout)


@pytest.mark.parametrize("figure", figures(), ids=lambda figure: figure.name)
def test_panels_do_not_overlap(figure: Figure) -> None:
    found = plotly_data(figure)
    for layout in (found["layout"], found["narrow"]):
        ends = ["" if n == 0 else str(n + 1) for n in range(len(figure.panels))]
        boxes = [(layout[f"xaxis{n}"]["domain"], layout[f"yaxis{n}"]["domain"]) for n in ends]
        for number, one in enumerate(boxes):
            for low, high in one:
                assert 0 <= low < high <= 1
            for other in boxes[:number]:
                apart = [a[1] < b[0] or b[1] < a[0] for a, b in zip(one, other, strict=True)]
                assert any(apart)


def test_in_one_column_panels_stand_below_each_other() -> None:
    narrow = plotly_data(figures()[0])["narrow"]
    assert narrow["xaxis"]["domain"] == narrow["xaxis2"]["domain"] == [0, 1]
    assert narrow["yaxis"]["domain"][0] > narrow["yaxis2"]["domain"][1]


def test_a_curve_keeps_its_gap_and_a_logarithmic_axis_leaves_out_what_is_not_positive() -> None:
    line = Line(np.arange(4.0), np.array([1.0, np.nan, -1.0, 2.0]))
    (plain,) = drawing_of(line)["data"]
    np.testing.assert_array_equal(unpacked(plain["y"]), [1, np.nan, -1, 2])
    (log,) = drawing_of(line, y=Axis("y", log=True))["data"]
    kept = unpacked(log["y"])
    assert kept[0] == 1
    assert kept[-1] == 2
    assert np.isnan(kept[1:-1]).all()


def test_a_name_stands_once_in_the_legend_and_holds_its_curves_together() -> None:
    t = np.arange(3.0)
    found = drawing_of(
        Line(t, t, "a"), Line(t, -t, "a"), Line(t, t), Level(1.0, "b"), Level(2.0, "b")
    )
    entries = [*found["data"], *found["layout"]["shapes"]]
    assert [e.get("legendgroup") for e in entries] == ["a", "a", None, "b", "b"]
    assert [e["showlegend"] for e in entries] == [True, False, False, True, False]


def test_texts_are_no_markup_for_plotly() -> None:
    t = np.arange(2.0)
    figure = Figure("f", "F", (Panel(Axis(HOSTILE), Axis("y"), (Line(t, t, HOSTILE),), HOSTILE),))
    found = plotly_data(figure)
    texts = [
        found["data"][0]["name"],
        found["layout"]["xaxis"]["title"]["text"],
        found["layout"]["annotations"][0]["text"],
    ]
    for text in texts:
        assert "<" not in text
        assert ">" not in text
        assert "&amp;lt;" in text


def test_parts_below_zero_are_stacked_downwards() -> None:
    t = np.arange(3.0)
    parts = np.array([[1.0, -2.0], [3.0, 4.0], [5.0, -6.0]])
    found = drawing_of(Stack(t, parts, ("a", "b")))["data"]
    stacked = {(e["legendgroup"], e["stackgroup"]): unpacked(e["y"]).tolist() for e in found}
    assert stacked == {
        ("a", "up"): [1, 3, 5],
        ("b", "up"): [0, 4, 0],
        ("b", "down"): [-2, 0, -6],
    }


def test_more_parts_than_colours_are_told_apart() -> None:
    count = len(COLOURS) + 2
    stack = Stack(np.arange(3.0), np.ones((3, count)), tuple("abcdefghi"[:count]))
    found = drawing_of(stack)["data"]
    assert len({entry["fillcolor"] for entry in found}) == count


def test_a_bar_reaches_from_edge_to_edge() -> None:
    (bars,) = drawing_of(Bars(np.array([0.0, 1.0, 4.0]), np.array([2.0, 3.0])))["data"]
    assert unpacked(bars["x"]).tolist() == [0, 0, 1, 1, 4, 4]
    assert unpacked(bars["y"]).tolist() == [0, 2, 2, 3, 3, 0]


def test_cells_end_halfway_between_their_middles_as_the_axis_shows_it() -> None:
    cells = Cells(np.array([1.0, 100.0]), np.array([1.0, 3.0]), np.eye(2), Axis("z"))
    (log,) = drawing_of(cells, x=Axis("x", log=True))["data"]
    np.testing.assert_allclose(unpacked(log["x"]), [0.1, 10, 1000], rtol=1e-6)
    assert unpacked(log["y"]).tolist() == [0, 2, 4]


def test_each_word_of_a_map_has_its_own_colour() -> None:
    cells = Cells(
        np.arange(2.0),
        np.arange(1.0),
        np.array([[0.0, 2.0]]),
        Axis("z", categories=("a", "b", "c")),
    )
    found = drawing_of(cells)
    scale = found["layout"]["coloraxis"]
    tones = [scale["colorscale"][2 * n][1] for n in range(3)]
    assert len(set(tones)) == 3
    # The legend has the words that occur, in their colours; there is no colour bar.
    legend = {e["name"]: e["marker"]["color"] for e in found["data"] if e["showlegend"]}
    assert legend == {"a": tones[0], "c": tones[2]}
    assert not scale["showscale"]
    own = replace(cells, scale=replace(cells.scale, colours=(5, 0, 1)))
    chosen = drawing_of(own)["layout"]["coloraxis"]["colorscale"]
    assert [tone for _, tone in chosen[::2]] == [colour(5), colour(0), colour(1)]


def test_a_scale_spans_what_is_shown_or_what_it_is_told() -> None:
    values = np.array([[np.nan, 0.1], [10.0, -1.0]])
    middles = np.arange(2.0)
    found = drawing_of(Cells(middles, middles, values, Axis("z")))["layout"]["coloraxis"]
    assert (found["cmin"], found["cmax"]) == (-1, 10)
    log = drawing_of(Cells(middles, middles, values, Axis("z", log=True)))["layout"]["coloraxis"]
    assert (log["cmin"], log["cmax"]) == pytest.approx((-1, 1))
    given = drawing_of(Cells(middles, middles, values, Axis("z"), (0.0, 2.0)))["layout"][
        "coloraxis"
    ]
    assert (given["cmin"], given["cmax"]) == (0, 2)


@pytest.mark.parametrize("end", [3.0, 1e3, 1e30])
def test_a_logarithmic_scale_has_its_ticks_at_round_numbers(end: float) -> None:
    cells = Cells(np.arange(2.0), np.arange(1.0), np.array([[0.5, end]]), Axis("z", log=True))
    bar = drawing_of(cells)["layout"]["coloraxis"]["colorbar"]
    np.testing.assert_allclose(
        10.0 ** np.array(bar["tickvals"]), [float(text) for text in bar["ticktext"]], rtol=1e-9
    )
    inside = [tick for tick in bar["tickvals"] if np.log10(0.5) <= tick <= np.log10(end)]
    assert 2 <= len(inside) <= 12


def test_cells_without_a_value_have_a_tone_for_each_reason() -> None:
    gaps = np.array([[-1, 0], [2, 2]])
    members = CellMembers(np.ones((2, 2), int), np.arange(4).reshape(2, 2), "", gaps, tuple("abc"))
    values = np.array([[1.0, np.nan], [np.nan, np.nan]])
    middles = np.arange(2.0)
    _, first, third = drawing_of(Cells(middles, middles, values, Axis("z"), None, members))["data"]
    assert (first["name"], third["name"]) == ("no value: a", "no value: c")
    assert unpacked(first["z"]).tolist() == [[0, 1], [0, 0]]
    assert unpacked(third["z"]).tolist() == [[0, 0], [1, 1]]
    assert first["colorscale"][1] != third["colorscale"][1]


def test_a_band_is_closed_and_divided_at_its_gaps() -> None:
    low = np.array([0.0, 1.0, np.nan, 3.0, 4.0])
    one, two = drawing_of(Band(np.arange(5.0), low, low + 10, "band"))["data"]
    assert unpacked(one["x"]).tolist() == [0, 1, 1, 0]
    assert unpacked(one["y"]).tolist() == [0, 1, 11, 10]
    assert unpacked(two["x"]).tolist() == [3, 4, 4, 3]
    assert [one["showlegend"], two["showlegend"]] == [True, False]


def test_a_colour_bar_does_not_repeat_the_title_of_its_panel() -> None:
    middles = np.arange(2.0)
    cells = Cells(middles, middles, np.eye(2), Axis("time", "s"))
    for title, expected in (("time [s]", ""), ("free", "time [s]")):
        figure = Figure("f", "F", (Panel(PLAIN, PLAIN, (cells,), title),))
        bar = plotly_data(figure)["layout"]["coloraxis"]["colorbar"]
        assert bar["title"]["text"] == expected


def test_a_map_ends_where_its_cells_do() -> None:
    cells = Cells(np.array([1.0, 100.0]), np.array([1.0, 3.0]), np.eye(2), Axis("z"))
    point = Points(np.array([100.0]), np.array([3.0]), "largest")
    layout = drawing_of(cells, point, x=Axis("x", log=True))["layout"]
    # Of a logarithmic axis plotly takes the exponents.
    assert layout["xaxis"]["range"] == pytest.approx([-1, 3])
    assert layout["yaxis"]["range"] == [0, 4]


@pytest.mark.parametrize(("low", "high", "kind"), [(-1, 1, "i1"), (0, 300, "i2"), (-1, 9**5, "i4")])
def test_whole_numbers_take_few_bytes(low: int, high: int, kind: str) -> None:
    values = np.array([[low, high, 0]])
    packed = packed_integers(values)
    assert packed["dtype"] == kind
    np.testing.assert_array_equal(unpacked(packed), values)


def test_arrays_that_maps_have_in_common_are_given_once() -> None:
    numbers = np.arange(9).reshape(3, 3)
    members = CellMembers(np.ones((3, 3), int), numbers, "", np.full((3, 3), -1))
    whole = compared_maps(2)
    maps = [mark for panel in whole.panels for mark in panel.marks if isinstance(mark, Cells)]
    panels = tuple(
        replace(panel, marks=(replace(cells, members=members),))
        for panel, cells in zip(whole.panels, maps, strict=True)
    )
    found = page_data(replace(whole, panels=panels, command="run --member"))
    first, second = found["cells"]
    assert first == second
    # Columns and rows have the same centres here.
    assert first["x"] == first["y"]
    assert len(found["arrays"]) == 4
    assert unpacked(found["arrays"][first["shown"]]).tolist() == numbers.tolist()
    assert found["command"] == "run --member"


def test_a_level_goes_through_the_whole_panel() -> None:
    flat, vertical = drawing_of(Level(2.0), Level(3.0, vertical=True))["layout"]["shapes"]
    assert (flat["xref"], flat["x0"], flat["x1"]) == ("x domain", 0, 1)
    assert (flat["yref"], flat["y0"], flat["y1"]) == ("y", 2, 2)
    assert (vertical["yref"], vertical["xref"], vertical["x0"]) == ("y domain", "x", 3)


@pytest.mark.parametrize(
    "values",
    [
        np.array([1e9, 1e9 + 1e-3]),
        np.array([1e-60, 1e-50]),
        np.array([1e60, -1e60]),
        np.array([0.1, 0.2, np.nan]),
        np.array([]),
    ],
    ids=["ripple", "small", "large", "gap", "none"],
)
def test_numbers_lose_nothing_that_can_be_seen(values: Any) -> None:
    found = unpacked(packed_array(values))
    span = np.ptp(values[np.isfinite(values)]) if len(values) else 0
    np.testing.assert_allclose(found, values, rtol=0, atol=1e-5 * span)


def test_infinity_leaves_a_gap() -> None:
    assert np.isnan(unpacked(packed_array(np.array([np.inf, -np.inf, np.nan])))).all()


def test_a_curve_behind_others_is_wider_and_paler_and_keeps_its_place_in_the_legend() -> None:
    x = np.arange(4.0)
    behind, before = drawing_of(Line(x, x, "behind", depth=1), Line(x, -x, "before"))["data"]
    assert behind["zorder"] < before.get("zorder", 0)
    assert behind["opacity"] < 1.0
    assert "opacity" not in before
    assert behind["line"]["width"] > before["line"]["width"]
    go.Figure(data=[behind, before])
