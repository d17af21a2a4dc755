"""Protects maps that are compared in one figure: titles, scales, and colour bars."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.compared_maps import compared_maps

from rbstab.report.model.figure import Axis, Cells, Figure, Panel
from rbstab.report.writers.matplotlib_figures.renderer import draw_figure
from rbstab.report.writers.plotly_figures.renderer import plotly_data

X = np.linspace(0.5, 2.0, 7)


def test_maps_that_compare_share_titles_scales_and_one_colour_bar() -> None:
    found = plotly_data(compared_maps(5, shared="xy"))
    for name in ("layout", "narrow"):
        layout = found[name]
        assert [key for key in layout if key.startswith("coloraxis")] == ["coloraxis"]
        for axis in (layout[f"{letter}axis{n}"] for letter in "xy" for n in range(2, 6)):
            assert axis["matches"] in ("x", "y")
            assert axis["tickfont"] == layout["xaxis"]["tickfont"]
    assert {e["coloraxis"] for e in found["data"]} == {"coloraxis"}
    whole = plotly_data(compared_maps(6, shared="xy"))["layout"]
    titles = [whole[key]["title"]["text"] for key in whole["meta"]["axes"]]
    # One title below all, and one beside each row.
    assert titles == ["", "up [s]", *[""] * 5, "up [s]", *[""] * 4]
    assert whole["annotations"][-1]["text"] == "across [m]"
    # The lowest panel of each column has tick labels, and the first of each row.
    assert shown_at(found["layout"], "x") == [False, False, True, True, True]
    assert shown_at(found["layout"], "y") == [True, False, False, True, False]


def shown_at(layout: dict[str, Any], letter: str) -> list[bool]:
    """Return whether each axis of five panels has tick labels."""
    return [layout[f"{letter}axis{n or ''}"]["showticklabels"] for n in ("", 2, 3, 4, 5)]


def test_beside_an_empty_cell_each_column_and_each_row_of_maps_has_its_titles() -> None:
    found = plotly_data(compared_maps(5, shared="xy"))
    wide, narrow = found["layout"], found["narrow"]
    for letter, text in (("x", "across [m]"), ("y", "up [s]")):
        titles = [wide[f"{letter}axis{n or ''}"]["title"]["text"] for n in ("", 2, 3, 4, 5)]
        assert titles == [text if shown else "" for shown in shown_at(wide, letter)]
    assert [note["text"] for note in wide["annotations"]] == list("01234")
    # The upper row has room for the title of its last panel.
    full = plotly_data(compared_maps(6, shared="xy"))["layout"]
    assert wide["height"] == full["height"] + 22
    assert narrow["annotations"][-1]["text"] == "across [m]"


def test_a_square_map_is_as_high_as_it_is_wide() -> None:
    figure = compared_maps(4, shared="xy")
    panels = tuple(replace(panel, square=True) for panel in figure.panels)
    for columns in (1, 2):
        square = replace(figure, panels=panels, columns=columns)
        layout = plotly_data(square)["layout"]
        wide, high = (layout[f"{letter}axis"]["domain"] for letter in "xy")
        margin = layout["margin"]
        width = (wide[1] - wide[0]) * (880 - margin["l"] - margin["r"])
        height = (high[1] - high[0]) * (layout["height"] - margin["t"] - margin["b"])
        assert height == pytest.approx(min(width, 420), abs=2)
    drawing = draw_figure(replace(figure, panels=panels))
    drawing.draw_without_rendering()
    for axes in drawing.axes[:4]:
        box = axes.get_window_extent()
        assert box.width == pytest.approx(box.height, rel=1e-6)


def test_titles_beside_an_empty_cell_have_lines_that_fit() -> None:
    figure = compared_maps(5, shared="xy")
    long = Axis("initial angular_velocity[1]", "rad/s")
    panels = tuple(replace(panel, x=long, y=long) for panel in figure.panels)
    wide = plotly_data(replace(figure, panels=panels))["layout"]
    assert wide["xaxis3"]["title"]["text"] == "initial angular_<br>velocity[1] [rad/s]"
    assert wide["yaxis"]["title"]["text"] == long.text
    assert wide["margin"]["b"] == 24 + 22 + 14


def test_panels_that_do_not_compare_keep_their_own() -> None:
    layout = plotly_data(compared_maps(2))["layout"]
    assert "coloraxis2" in layout
    assert "matches" not in layout["xaxis2"]
    assert layout["xaxis2"]["title"]["text"] == "across [m]"


@pytest.mark.parametrize(("shared", "bars", "titles"), [("xy", 1, 1), ("", 3, 3)])
def test_maps_of_matplotlib_share_titles_and_one_colour_bar(shared, bars, titles):
    cells = [Cells(X, X, np.outer(X, X) * n, Axis("z"), (0.0, 9.0)) for n in (1, 2, 3)]
    panels = tuple(Panel(Axis("across", "m"), Axis("up", "s"), (c,), "map") for c in cells)
    drawing = draw_figure(Figure("f", "F", panels, 3, shared=shared))
    assert len(drawing.axes) == 3 + bars
    own = [axes.get_xlabel() for axes in drawing.axes[:3] if axes.get_xlabel()]
    common = [drawing.get_supxlabel()] if drawing.get_supxlabel() else []
    assert len(own + common) == titles
    assert all(len(axes.get_yticks()) >= 3 for axes in drawing.axes[3:])


def test_beside_an_empty_cell_of_matplotlib_each_column_and_each_row_has_its_titles():
    cells = Cells(X, X, np.outer(X, X), Axis("z"), (0.0, 9.0))
    panel = Panel(Axis("across", "m"), Axis("up", "s"), (cells,), "map")
    drawing = draw_figure(Figure("f", "F", (panel,) * 5, 3, shared="xy"))
    assert (drawing.get_supxlabel(), drawing.get_supylabel()) == ("", "")
    maps = drawing.axes[:5]
    assert [bool(axes.get_xlabel()) for axes in maps] == [False, False, True, True, True]
    assert [bool(axes.get_ylabel()) for axes in maps] == [True, False, False, True, False]


def test_a_long_symbol_is_not_broken_for_its_unit():
    label = Axis("initial angular_velocity[0]", "rad/s")
    maps = (Panel(label, label, (Cells(X, X, np.outer(X, X), Axis("z")),)),) * 5
    drawing = draw_figure(Figure("f", "F", maps, 3, shared="xy"))
    for axes in drawing.axes[:5]:
        for title in (axes.get_xlabel(), axes.get_ylabel()):
            assert not title or "angular_velocity[0]" in title


def test_all_panels_of_maps_are_equally_wide() -> None:
    """Whether a colour bar has a title, has none, or a map of words has no colour bar."""
    values = np.outer(X, X)
    scales = (
        (Axis("a", "s"), "a [s]"),
        (Axis("b", "m"), "of one condition"),
        (Axis("words", categories=("x", "y")), "words"),
        (Axis("c", log=True), "c"),
    )
    panels = tuple(
        Panel(Axis("across"), Axis("up"), (Cells(X, X, np.round(values / 4), scale),), title)
        for scale, title in scales
    )
    for columns in (1, 2, 3):
        found = plotly_data(Figure("maps", "Maps", panels, columns))
        for name in ("layout", "narrow"):
            domains = [found[name][f"xaxis{n or ''}"]["domain"] for n in ("", 2, 3, 4)]
            assert np.ptp(domains, axis=1) == pytest.approx(np.ptp(domains[0]))
