"""Protects quantiles and cumulative distributions against numbers that can be counted by hand."""

import numpy as np
import pytest
from support.made_sweeps import GRID, code
from support.sections import figures_in, sweep_sections, tables

from rbstab.report.model.figure import Line
from rbstab.report.sweeps.outcomes import MAX_CURVES

DRAWN = {"design": "random", "members": 100, "seed": 4}
EACH = {
    "controller.variant": {"each": {"values": ["visco-elastic", "free"]}},
    "body.mass": {"uniform": [1, 2]},
}


def test_quantiles_are_those_of_members_that_have_a_number(made):
    """The first member failed. The last is not at rest by the end: later than all others."""

    def columns(a):
        settling = np.where(a["run"] == 100, np.inf, a["run"])
        return {"settling_time": settling, "status": np.where(a["run"] == 0, code("diverged"), 0)}

    sections = sweep_sections(made({"body.mass": {"linspace": [1, 101, 101]}}, columns))
    table = tables(sections)["sweep-1-quantiles"]
    (row,) = (row for row in table.rows if row[0].text == "settling time of v [s]")
    heads = [head.label for head in table.heads[1:]]
    assert heads == ["median", "5%", "95%", "minimum", "maximum", "members"]
    # Of 100 ranked values, the last of which is infinite: the first that has enough below it.
    assert [cell.value for cell in row[1:5]] == [50, 5, 95, 1]
    assert [cell.text for cell in row[5:]] == ["later", "100"]
    assert "count as later than" in table.note


def settled_by_variant(a):
    """Member k of a variant settles after k + 1 s, with `free` 100 s later; the last 20 do not."""
    point = a["run"] % 100
    settling = point + 1.0 + 100.0 * a["controller_variant"]
    return {
        "settling_time": np.where((a["controller_variant"] == 1) & (point >= 80), np.nan, settling)
    }


def test_each_condition_has_a_curve_and_nothing_is_pooled(made):
    sections = sweep_sections(made(EACH, settled_by_variant, **DRAWN))
    panels = {panel.x.label: panel for panel in figures_in(sections)["sweep-1-cumulative"].panels}
    first, second = panels["settling time of v"].marks
    assert isinstance(first, Line)
    assert isinstance(second, Line)
    assert (first.label, second.label) == ("visco-elastic", "free")
    # Of 100 members, exactly k are at rest by k seconds.
    at = np.array([1.0, 25.0, 50.0, 75.0, 100.0])
    shares = [first.y[first.x <= t].max() for t in at]
    assert shares == pytest.approx(at / 100)
    # The last 20 of the other variant have no value: its curve ends at 0.8.
    assert (second.x.min(), second.x.max(), second.y.max()) == (101.0, 180.0, 0.8)
    rows = {(row[0].text, row[1].text): row for row in tables(sections)["sweep-1-quantiles"].rows}
    assert rows["settling time of v [s]", "free"][2].value == pytest.approx(150)
    assert rows["settling time of v [s]", "free"][6].text == "later"


def test_only_drawn_members_and_few_conditions_have_curves(made):
    """How often a value occurs in a grid says how it was chosen."""
    masses = {"body.mass": {"each": {"values": [float(k) for k in range(1, MAX_CURVES + 2)]}}}
    spin = {"initial.angular_velocity[0]": {"normal": [0, 6]}}

    def columns(a):
        return {"settling_time": a["run"] + 1.0}

    for vary, keys, is_drawn in (
        (GRID, {}, False),
        (spin, DRAWN, True),
        (masses | spin, DRAWN | {"members": 5}, False),
    ):
        figures = figures_in(sweep_sections(made(vary, columns, **keys)))
        assert ("sweep-1-cumulative" in figures) is is_drawn
