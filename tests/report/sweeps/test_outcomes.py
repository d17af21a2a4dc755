"""Protects the counts of members by outcome, their confidence intervals, and their bars."""

import numpy as np
import pytest
from scipy.stats import binomtest
from support.made_sweeps import GRID, code
from support.sections import figures_in, sweep_sections, tables, texts

from rbstab.report.model.figure import Shares
from rbstab.report.sweeps.outcomes import EVEN_DESIGN_NOTE, GRID_NOTE, POOLED_NOTE, wilson
from rbstab.sweep.proofs.columns import NO_PROOF, PROVED

DRAWN = {"body.mass": {"uniform": [1, 2]}}
RANDOM = {"design": "random", "members": 100, "seed": 1}
EACH = {"controller.variant": {"each": {"values": ["free", "visco-elastic"]}}}


def test_the_interval_is_that_of_wilson():
    pairs = [(0, 1), (0, 40), (3, 40), (20, 40), (40, 40), (1, 1000)]
    counts, totals = np.array(pairs).T
    value, low, high = wilson(counts, totals)
    for k, (count, total) in enumerate(pairs):
        expected = binomtest(count, total).proportion_ci(0.95, method="wilson")
        assert value[k] == count / total
        assert (low[k], high[k]) == pytest.approx((expected.low, expected.high), abs=1e-12)
    assert np.isnan(wilson(np.zeros(1), np.zeros(1))).all()


def ended(a):
    """Of 100 members 30 do not settle, of which 7 leave the range and 3 diverge."""
    status, settling = np.zeros(100), np.full(100, 0.5)
    status[:7], status[7:10] = code("range left"), code("diverged")
    settling[:30] = np.nan
    return {"status": status, "settling_time": settling}


def test_a_table_of_what_was_drawn(made):
    table = tables(sweep_sections(made(DRAWN, ended, **RANDOM)))["sweep-1-fractions"]
    assert {row[0]: row[1] for row in texts(table)} == {
        "completed": "90",
        "returns": "70",
        "still moving": "20",
        "left the range": "7",
        "failed": "3",
        "failed: diverged": "3",
        "completed, |E| below 1 mm from some time on": "90",
    }
    left = next(row for row in table.rows if row[0].text == "left the range")
    interval = binomtest(7, 100).proportion_ci(method="wilson")
    assert [c.value for c in left[1:]] == pytest.approx([7, 0.07, interval.low, interval.high])


def of_conditions(a):
    """Of visco-elastic five of 16 are late, and nine of the sixteen that were tried are proved."""
    tied, point = a["controller_variant"] == 1, a["run"] % 16
    tried = np.where(point < 9, PROVED, NO_PROOF + 1)
    return {
        "settling_time": np.where(tied & (point < 5), np.nan, 0.5),
        "convergence": np.where(tied, tried, np.where(point < 15, PROVED, NO_PROOF)),
    }


def test_each_condition_has_rows_and_a_bar(made):
    """Where not all were tried, there is no fraction of those proved."""
    sections = sweep_sections(made(DRAWN | EACH, of_conditions, **RANDOM | {"members": 16}))
    table = tables(sections)["sweep-1-fractions"]
    counts = {tuple(row[:2]): row[2] for row in texts(table)}
    assert [counts["returns", name] for name in ("free", "visco-elastic")] == ["16", "11"]
    assert [key for key in counts if key[0] == "proved to converge"] == [
        ("proved to converge", "visco-elastic")
    ]
    assert counts["proved to converge", "visco-elastic"] == "9"
    assert [head.label for head in table.heads][-2:] == ["lower 95% limit", "upper 95% limit"]
    (panel,) = figures_in(sections)["sweep-1-outcomes"].panels
    (bars,) = panel.marks
    assert isinstance(bars, Shares)
    # The first one is the highest.
    assert panel.y.categories == ("visco-elastic", "free")
    assert bars.labels == ("returns", "still moving")
    assert bars.counts.tolist() == [[11, 5], [16, 0]]


MANY = {"body.mass": {"each": {"values": [float(k) for k in range(1, 14)]}}}


@pytest.mark.parametrize(
    ("vary", "design", "note", "columns"),
    [
        (GRID, {}, GRID_NOTE, 3),
        (DRAWN, {"design": "sobol", "members": 16, "seed": 1}, EVEN_DESIGN_NOTE, 5),
        # More conditions than are compared.
        (MANY | {"gravity[2]": {"uniform": [9, 10]}}, RANDOM | {"members": 8}, POOLED_NOTE, 3),
    ],
    ids=["grid", "sobol", "each"],
)
def test_what_is_no_random_draw_is_told_apart(made, vary, design, note, columns):
    table = tables(sweep_sections(made(vary, **design)))["sweep-1-fractions"]
    assert note in table.note
    assert len(table.heads) == columns
