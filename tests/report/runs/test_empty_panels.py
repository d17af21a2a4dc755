"""Protects figures against empty axes: panels with nothing to show are left out, and named."""

import numpy as np
import pytest

from rbstab.report.model.figure import Axis, Figure, Level, Line, Panel, Points, Stack
from rbstab.report.runs.figures.empty_panels import without_empty_panels

X = np.linspace(0.0, 1.0, 5)


def panel_of(label, *marks, log=False):
    return Panel(Axis("x"), Axis(label, log=log), marks)


FULL = panel_of("full", Line(X, X - 0.5))
EMPTY = {
    "zeros": (panel_of("q", Line(X, 0 * X)), "zero throughout"),
    "zero stack": (panel_of("q", Stack(X, np.zeros((5, 2)), ("a", "b"))), "zero throughout"),
    "no number": (panel_of("q", Line(X, X * np.nan)), "no value"),
    "negative on a logarithmic axis": (panel_of("q", Line(X, -1 - X), log=True), "no value"),
    "only a level": (panel_of("q", Level(0.5)), "no value"),
    "no marks": (panel_of("q"), "no value"),
    "no points": (panel_of("q", Points(X[:0], X[:0])), "no value"),
}


@pytest.mark.parametrize("case", EMPTY)
def test_an_empty_panel_is_left_out_and_named(case):
    panel, reason = EMPTY[case]
    found = without_empty_panels(Figure("f", "F", (FULL, panel), caption="Words."))
    assert isinstance(found, Figure)
    assert found.panels == (FULL,)
    assert found.caption.startswith("Words. Left out: q (")
    assert reason in found.caption


def test_a_figure_with_something_in_each_panel_stays():
    one_value = panel_of("one", Line(X, np.where(X == 1.0, 1.0, -1.0)), log=True)
    figure = Figure("f", "F", (FULL, one_value))
    assert without_empty_panels(figure) is figure


def test_a_quantity_that_is_still_drawn_is_left_out_on_one_axis_only():
    panels = (panel_of("v", Line(X, -1 - X)), panel_of("v", Line(X, -1 - X), log=True))
    found = without_empty_panels(Figure("f", "F", panels))
    assert isinstance(found, Figure)
    assert found.panels == panels[:1]
    assert "v on a logarithmic axis (no value" in found.caption


def test_of_a_figure_without_any_panel_a_sentence_is_left():
    panels = tuple(panel for panel, _ in EMPTY.values())
    found = without_empty_panels(Figure("f", "Decay", panels))
    assert isinstance(found, str)
    assert found.startswith("Decay: there is no figure. Left out: q (")
