"""Protects the fractions of members by outcome, and their confidence intervals."""

import numpy as np
import pytest
from scipy.stats import binomtest
from support.made_sweeps import GRID, code
from support.sections import figures_in, sweep_sections, tables, texts

from rbstab.report.model.figure import Shares
from rbstab.report.sweeps.fractions import EVEN_DESIGN_NOTE, GRID_NOTE, POOLED_NOTE, fraction
from rbstab.report.sweeps.members import OUTCOME_COLOURS, OUTCOMES
from rbstab.sweep.proofs.columns import NO_PROOF, PROVED

Z = 1.959963984540054
"""The 97.5 % quantile of the normal distribution."""

DRAWN = {"body.mass": {"uniform": [1, 2]}}


@pytest.mark.parametrize(("count", "of"), [(0, 1), (0, 40), (3, 40), (20, 40), (40, 40), (1, 1000)])
def test_the_interval_is_that_of_wilson(count, of):
    """Wilson (1927): the p whose distance from the found share is Z standard deviations."""
    found = fraction("", np.arange(of) < count)
    share, spread = count / of, Z**2 / of
    middle = (share + spread / 2) / (1 + spread)
    half = Z * np.sqrt(share * (1 - share) / of + spread / (4 * of)) / (1 + spread)
    assert found.value == share
    assert (found.low, found.high) == pytest.approx((middle - half, middle + half), abs=1e-12)


def test_a_table_of_what_was_drawn(made):
    def columns(a):
        status = np.zeros(100)
        status[:7], status[7:10] = code("range left"), code("diverged")
        settling = np.full(100, 0.5)
        settling[:30] = np.nan
        return {"status": status, "settling_time": settling, "convergence": 1 + (a["run"] > 55)}

    sections = sweep_sections(made(DRAWN, columns, design="random", members=100, seed=1))
    table = tables(sections)["sweep-1-fractions"]
    counts = {row[0]: row[1] for row in texts(table)}
    assert counts == {
        "completed": "90",
        "returns": "70",
        "still moving": "20",
        "left the range": "7",
        "failed": "3",
        "failed: diverged": "3",
        "completed, |E| below 1 mm from some time on": "90",
        "proved to converge": "44",
    }
    left = next(row for row in table.rows if row[0].text == "left the range")
    interval = binomtest(7, 100).proportion_ci(method="wilson")
    assert [cell.value for cell in left[1:]] == [7, 0.07, interval.low, interval.high]


def test_of_proofs_of_some_members_there_is_no_fraction_of_all(made):
    def columns(a):
        return {"convergence": np.where(a["run"] < 90, PROVED, NO_PROOF)}

    sections = sweep_sections(made(DRAWN, columns, design="random", members=100, seed=1))
    rows = [row[0] for row in texts(tables(sections)["sweep-1-fractions"])]
    assert "completed" in rows
    assert "proved to converge" not in rows


def bars_of(sections):
    """Return the names of the bars from the top, and the counts of each by outcome."""
    (panel,) = figures_in(sections)["sweep-1-outcomes"].panels
    (mark,) = panel.marks
    assert isinstance(mark, Shares)
    rows = [dict(zip(mark.labels, row, strict=True)) for row in mark.counts.tolist()]
    return dict(zip(panel.y.categories[::-1], rows[::-1], strict=True)), mark


def test_all_members_are_one_bar(made):
    def columns(a):
        status = np.zeros(100)
        status[:7], status[7:10], status[10] = map(code, ("range left", "diverged", "step limit"))
        settling = np.full(100, 0.5)
        settling[:31] = np.nan
        return {"status": status, "settling_time": settling}

    sections = sweep_sections(made(DRAWN, columns, design="random", members=100, seed=1))
    bars, mark = bars_of(sections)
    parts = {"returns: 69": 69, "still moving: 20": 20, "left the range: 7": 7, "failed: 4": 4}
    assert bars == {"100 members": parts}
    assert mark.values[0] == pytest.approx([0.69, 0.2, 0.07, 0.04])
    # The colours of the maps.
    words = ("returns", "still moving", "left the range", "failed")
    assert mark.colours == tuple(OUTCOME_COLOURS[OUTCOMES.index(word)] for word in words)


def test_each_condition_has_a_bar_and_the_first_is_the_highest(made):
    each = {"controller.variant": {"each": {"values": ["free", "visco-elastic"]}}}

    def columns(a):
        late = (a["controller_variant"] == 1) & (a["run"] % 16 < 5)
        return {"settling_time": np.where(late, np.nan, 0.5)}

    sections = sweep_sections(made(DRAWN | each, columns, design="random", members=16, seed=1))
    bars, _ = bars_of(sections)
    assert list(bars) == ["free", "visco-elastic"]
    assert bars["free"] == {"returns": 16, "still moving": 0}
    assert bars["visco-elastic"] == {"returns": 11, "still moving": 5}


def test_members_that_all_ended_alike_need_no_bar(made):
    sections = sweep_sections(made(DRAWN, design="random", members=16, seed=1))
    assert "sweep-1-outcomes" not in figures_in(sections)


@pytest.mark.parametrize(
    ("vary", "design", "note", "columns"),
    [
        (GRID, {}, GRID_NOTE, 3),
        (DRAWN, {"design": "sobol", "members": 16, "seed": 1}, EVEN_DESIGN_NOTE, 5),
        (
            DRAWN | {"controller.variant": {"each": {"values": ["free", "visco-elastic"]}}},
            {"design": "random", "members": 16, "seed": 1},
            POOLED_NOTE,
            3,
        ),
    ],
    ids=["grid", "sobol", "each"],
)
def test_what_is_no_random_draw_is_told_apart(made, vary, design, note, columns):
    sections = sweep_sections(made(vary, **design))
    table = tables(sections)["sweep-1-fractions"]
    assert note in table.note
    assert len(table.heads) == columns
