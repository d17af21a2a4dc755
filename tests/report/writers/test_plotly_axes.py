"""Protects the axes of figures on a page: their ticks, labels and scales."""

from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
from report.writers.plotly_drawings import PLAIN, drawing_of, unpacked
from support.pages import figures

from rbstab.report.model.figure import (
    Axis,
    Bars,
    Cells,
    Figure,
    Level,
    Line,
    Panel,
    Points,
    Stack,
)
from rbstab.report.model.split_time import SplitTime
from rbstab.report.writers.plotly_figures.renderer import plotly_data
from rbstab.report.writers.plotly_figures.tick_words import tick_lines


def test_times_zoom_together_and_equal_axes_are_equal() -> None:
    over_time, _, counts = (plotly_data(figure)["layout"] for figure in figures())
    assert over_time["xaxis2"]["matches"] == over_time["xaxis3"]["matches"] == "x"
    assert "matches" not in counts["xaxis2"]
    assert (counts["yaxis3"]["scaleanchor"], counts["yaxis3"]["scaleratio"]) == ("x3", 1)


def test_a_split_time_axis_is_two_axes_with_one_vertical_axis() -> None:
    t = np.linspace(0.0, 2.0, 201)
    x = Axis("time t", "s", split=SplitTime(0.0, 0.105, 2.0))
    marks = (
        Line(t, np.exp(-30 * t), "decay"),
        Stack(t, np.column_stack([t, t * t]), ("a", "b")),
        Points(np.array([0.05, 1.0]), np.zeros(2), "events", texts=("early", "late")),
        Level(0.5, "height"),
        Level(1.5, "late", vertical=True),
    )
    panels = (Panel(x, Axis("y"), marks), Panel(x, Axis("z"), (Line(t, t),)))
    found = plotly_data(Figure("f", "F", panels, columns=2, shares_time=True))
    go.Figure({"data": found["data"], "layout": found["layout"]})
    for layout in (found["layout"], found["narrow"]):
        ends = ("", "3"), ("2", "4")
        for first, second in ends:
            one, other = (layout[f"xaxis{end}"] for end in (first, second))
            assert one["domain"][1] < other["domain"][0]
            width = other["domain"][1] - one["domain"][0]
            assert (one["domain"][1] - one["domain"][0]) / width == pytest.approx(0.4, abs=0.03)
            assert (one["range"], other["range"]) == ([0.0, 0.105], [0.105, 2.0])
            assert one["anchor"] == other["anchor"]
        # The same parts of both panels zoom together.
        assert layout["xaxis2"]["matches"] == "x"
        assert layout["xaxis4"]["matches"] == "x3"
        assert "matches" not in layout["xaxis3"]
        assert {"xaxis3", "xaxis4"} <= set(layout["meta"]["axes"])
    decays = [trace for trace in found["data"] if trace.get("legendgroup") == "decay"]
    assert [trace["xaxis"] for trace in decays] == ["x", "x3"]
    assert [trace["showlegend"] for trace in decays] == [True, False]
    first, second = (unpacked(trace["x"]) for trace in decays)
    # No segment is missing: both parts have the points around the border.
    assert first[0] == 0
    assert second[0] <= 0.105 <= first[-1]
    assert second[-1] == 2
    assert sum(trace.get("legendgroup") == "a" for trace in found["data"]) == 2
    events = [trace for trace in found["data"] if trace.get("legendgroup") == "events"]
    assert [trace["text"] for trace in events] == [["early"], ["late"]]
    levels = [shape for shape in found["layout"]["shapes"] if shape.get("legendgroup")]
    assert [shape["xref"] for shape in levels] == ["x domain", "x3 domain", "x3"]


def test_a_logarithmic_axis_has_room_for_its_labels() -> None:
    """With plotly's own number of ticks, the labels 9, 8, 7 overlap a power of ten."""
    line = (Line(np.array([0.0, 1.0]), np.array([1e-3, 1.0])),)
    panels = tuple(Panel(Axis("t"), Axis("v", log=log), line) for log in (True, False))
    layout = plotly_data(Figure("f", "F", panels))["layout"]
    assert layout["yaxis"]["nticks"] <= 4
    assert "nticks" not in layout["yaxis2"]


@pytest.mark.parametrize(("low", "written_out"), [(1e-1, True), (1e-5, False)])
def test_labels_between_powers_of_ten_are_whole_numbers(low: float, written_out: bool) -> None:
    panel = Panel(Axis("t"), Axis("v", log=True), (Line(np.arange(3.0), np.array([0.0, low, 10])),))
    layout = plotly_data(Figure("f", "F", (panel,)))["layout"]
    assert layout["yaxis"].get("tickformat") == ("~g" if written_out else None)


@pytest.mark.parametrize(("low", "formats"), [(1e-2, "~g"), (1e-14, "~e")])
def test_a_narrow_panel_has_labels_at_powers_of_ten_only(low: float, formats: str) -> None:
    """Between them, labels as 0.01 and 0.02 would overlap; a wide panel has room for them."""
    x = Axis("x", log=True)
    values = np.outer(np.arange(3.0), np.arange(5.0))
    cells = Cells(np.geomspace(low, 100 * low, 5), np.arange(3.0), values, Axis("z"))
    bars = Bars(np.geomspace(0.3 * low, 200 * low, 6), np.arange(5.0))
    for mark in (cells, bars):
        found = drawing_of(mark, x=x)
        wide, narrow = found["layout"]["xaxis"], found["narrow"]["xaxis"]
        assert wide["tickformat"] == narrow["tickformat"] == formats
        assert "dtick" not in wide
        assert (narrow["tick0"], narrow["dtick"]) == (0, 1)
        assert narrow["range"][0] < np.log10(low) < np.log10(low) + 2 < narrow["range"][1]
    # Where a power of ten is alone, the labels beside it are needed.
    short = Bars(np.geomspace(0.2 * low, 8 * low, 6), np.arange(5.0))
    assert "dtick" not in drawing_of(short, x=x)["narrow"]["xaxis"]


def category_axis(name: str, *labels: str) -> tuple[dict[str, Any], int]:
    """Return a horizontal axis of categories in a layout, and the space below the panel, px."""
    points = Points(np.arange(float(len(labels))), np.zeros(len(labels)))
    layout = drawing_of(points, x=Axis("outcome", categories=labels))[name]
    return layout["xaxis"], layout["margin"]["b"]


def test_words_of_categories_are_lines_with_room_below() -> None:
    labels = (
        "completed",
        "completed, settled",
        "|E| below 1 mm from some time on",
        "visco-elastic",
    )
    axis, below = category_axis("narrow", *labels)
    assert axis["tickangle"] == 0
    assert [text.replace("<br>", " ") for text in axis["ticktext"]] == [
        *labels[:2],
        "|E| below 1\u00a0mm from some time on",
        "visco- elastic",
    ]
    lines = [text.split("<br>") for text in axis["ticktext"]]
    assert max(len(line) for label in lines for line in label) <= 11
    wide, shallow = category_axis("layout", *labels)
    assert max(text.count("<br>") for text in wide["ticktext"]) < max(map(len, lines)) - 1
    assert below >= shallow + 14 > shallow


def test_the_first_and_the_last_category_have_room_for_their_labels() -> None:
    """Plotly leaves out a label that would be cut at the edge of a narrow page."""
    axis, _ = category_axis("narrow", "a", "b", "c")
    assert axis["range"] == [-0.5, 2.5]


def test_words_too_long_for_their_categories_stand_upright() -> None:
    axis, below = category_axis("narrow", *[f"{n}ncommonlylonglabel" for n in range(8)])
    assert axis["tickangle"] == 90
    assert below > 100
    assert axis["ticktext"][0] == "0ncommonlylonglabel"


def test_a_label_of_many_words_is_cut() -> None:
    assert tick_lines("one two three four", 4, 2) == ["one", "two …"]


@pytest.mark.parametrize(("most", "step"), [(2.0, 1), (8.0, 1), (40.0, None)])
def test_an_axis_that_counts_has_ticks_at_whole_numbers(most: float, step: int | None) -> None:
    """plotly's own ticks are at halves on short axes only."""
    counts = Axis("members", whole=True)
    bars = Bars(np.arange(4.0), np.array([1.0, most, 0.0]))
    line = Line(np.arange(3.0), np.array([0.0, most, most]))
    for mark in (bars, line):
        drawn = drawing_of(mark, y=counts)
        assert [drawn[name]["yaxis"].get("dtick") for name in ("layout", "narrow")] == [step, step]
        assert "dtick" not in drawing_of(mark)["layout"]["yaxis"]


def test_panels_with_one_axis_have_its_ticks() -> None:
    counts = Axis("members", whole=True)
    panels = [
        Panel(PLAIN, counts, (Bars(np.arange(3.0), np.array([1.0, most])),)) for most in (2.0, 40.0)
    ]
    layout = plotly_data(Figure("f", "F", tuple(panels), shared="y"))["layout"]
    assert "dtick" not in layout["yaxis"]


def small_figure(*titles: str) -> Figure:
    """Return a figure of small panels, three in a row, by the titles of their horizontal axes."""
    line = Line(np.arange(2.0), np.arange(2.0))
    panels = tuple(Panel(Axis(title, "rad/s"), Axis("y"), (line,), "a") for title in titles)
    return Figure("f", "F", panels, 3, shared="y", small=True)


def test_a_row_of_small_panels_has_one_title_below() -> None:
    name = "a long name of a parameter"
    found = plotly_data(small_figure(*[name] * 3, "other", "another", "a third"))
    layout = found["layout"]
    (title,) = [one for one in layout["annotations"] if name in one["text"]]
    assert title["text"] == f"{name} [rad/s]"
    assert title["xanchor"] == "center"
    left, right = layout["xaxis"]["domain"][0], layout["xaxis3"]["domain"][1]
    assert title["x"] == pytest.approx((left + right) / 2)
    assert title["y"] == pytest.approx(layout["yaxis"]["domain"][0])
    texts = [layout[f"xaxis{end}"]["title"]["text"] for end in ("", 2, 3, 4, 5, 6)]
    assert texts[:3] == [""] * 3
    assert [text.replace("<br>", " ") for text in texts[3:]] == [
        f"{own} [rad/s]" for own in ("other", "another", "a third")
    ]
    # On a phone two panels are side by side: the second row has two parameters.
    narrow = found["narrow"]["annotations"]
    assert len([one for one in narrow if one["text"] == f"{name} [rad/s]"]) == 1
