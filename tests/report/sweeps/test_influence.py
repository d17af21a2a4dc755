"""Protects the influence of parameters on an outcome, for functions with a known answer."""

import numpy as np
import pytest
from support.made_sweeps import SPIN
from support.sections import figures_in, sweep_sections, tables, texts

from rbstab.report.model.figure import Axis
from rbstab.report.sweeps.maps.influence import MAX_FOR_EDGES, ExplainedVariance, groups_of
from rbstab.report.sweeps.parameters import Parameter

VARY = {
    "body.mass": {"uniform": [1, 2]},
    f"{SPIN}[0]": {"uniform": [1, 2]},
    "controller.K_r": {"scale": {"uniform": [1, 2]}},
}


def test_a_sum_of_independent_parts_is_divided_by_their_variances(made):
    """For 3 a + 4 b with equally distributed a and b: 9/25 and 16/25 of the variance."""

    def columns(a):
        total = 3 * a["controller_K_r"] + 4 * a["body_mass"]
        return {"settling_time": total}

    sections = sweep_sections(made(VARY, columns, design="sobol", members=4096, seed=1))
    table = tables(sections)["sweep-1-influence"]
    names = [row[0] for row in texts(table)]
    assert names == ["mass", "K_r[0] (with all of K_r)", "initial angular_velocity[0]"]
    ratios = [row[1].value for row in table.rows]
    # Twenty groups miss 1/400 of the variance of a term.
    assert ratios == pytest.approx([0.64, 0.36, 0], abs=0.01)
    (panel,) = figures_in(sections)["sweep-1-map"].panels
    assert (panel.x.label, panel.y.label) == ("mass", "K_r[0] (with all of K_r)")


def test_groups_by_hand():
    groups = np.array([0, 0, 1, 3, 1, 0])
    values = np.array([1.0, 3.0, 8.0, np.nan, np.inf, 2.0])
    # The group means are 2 (three values) and 8 (one), the mean is 3.5: 3 * 1.5² + 4.5² = 27 of 29.
    assert ExplainedVariance(values).by(groups) == pytest.approx(27 / 29)
    assert ExplainedVariance(groups.astype(float)).by(groups) == pytest.approx(1)
    # Squares of such values would overflow.
    assert ExplainedVariance(1e200 * values).by(groups) == pytest.approx(27 / 29)
    assert np.isnan(ExplainedVariance(np.ones(6)).by(groups))
    assert np.isnan(ExplainedVariance(np.full(6, np.nan)).by(groups))


def test_many_members_have_ranges_of_nearly_equal_size(rng):
    """Their ends are those of members that are drawn, wherever these are in the sweep."""
    values = np.sort(rng.normal(size=2 * MAX_FOR_EDGES))
    parameter = Parameter("x", "x", Axis("x"), values, listed=False)
    counts = np.bincount(groups_of(parameter, np.arange(len(values))))
    # The ends are quantiles of a sample: their order has a standard deviation of 0.16 % at most.
    assert counts / len(values) == pytest.approx(np.full(20, 0.05), abs=0.01)
