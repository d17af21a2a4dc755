"""Protects the effects of parameters: what they explain, and curves along them."""

import numpy as np
import pytest
from support.made_sweeps import SPIN
from support.sections import figures_in, sweep_sections, tables, texts

from rbstab.report.model.figure import Band, Line
from rbstab.report.sweeps.maps.effects import explained
from rbstab.report.sweeps.outcomes import wilson

VARY = {
    "body.mass": {"uniform": [1, 2]},
    f"{SPIN}[0]": {"uniform": [0, 1]},
    "controller.K_r": {"scale": {"uniform": [0, 1]}},
}
DESIGN = {"design": "sobol", "members": 4096, "seed": 1}
SPUN = "initial_angular_velocity_0"
EFFECT = "sweep-1-effect-settling-time"


def effects_of(made, columns, vary=VARY, **keys):
    """The figures and tables of a sweep."""
    sections = sweep_sections(made(vary, columns, **DESIGN | keys))
    return figures_in(sections), tables(sections)


def marks_of(panel):
    band = [mark for mark in panel.marks if isinstance(mark, Band)]
    line = [mark for mark in panel.marks if isinstance(mark, Line)]
    return band, line


def test_the_median_and_the_band_are_those_of_the_other_parameter(made):
    """For t = 4 m + u with u uniform on 0 to 1: median 4 m + 1/2, band 4 m + 0.05 to 4 m + 0.95.

    A group is 1/20 of the range of m wide, which moves the quantiles by at most 0.05 * 4 / 2. Of
    the variance, m explains 16/17.
    """
    figures, _ = effects_of(made, lambda a: {"settling_time": 4 * a["body_mass"] + a[SPUN]})
    figure = figures[EFFECT]
    assert figure.shared == "y"
    # The parameter with more influence is first; K_r, without any, is left out.
    assert [p.x.label for p in figure.panels] == ["mass", "initial angular_velocity[0]"]
    assert [p.title for p in figure.panels] == ["explains 94%", "explains 6%"]
    (band,), (line,) = marks_of(figure.panels[0])
    assert len(line.x) == 20
    assert (np.diff(line.x) > 0).all()
    assert line.y == pytest.approx(4 * line.x + 0.5, abs=0.06)
    assert band.low == pytest.approx(4 * line.x + 0.05, abs=0.1)
    assert band.high == pytest.approx(4 * line.x + 0.95, abs=0.1)


def test_the_share_of_an_outcome_has_wilsons_interval(made):
    def columns(a):
        return {"settling_time": np.where(a[SPUN] < a["body_mass"] - 1, 1, np.nan)}

    figures, _ = effects_of(made, columns)
    mass = next(p for p in figures["sweep-1-effect-outcome"].panels if p.x.label == "mass")
    (band,), (line,) = marks_of(mass)
    # Of members with a mass m, a share m - 1 has a smaller spin.
    assert line.y == pytest.approx(line.x - 1, abs=0.03)
    # The groups have 4096 / 20 members.
    _, low, high = wilson(line.y * 204.8, np.full(20, 204.8))
    assert band.low == pytest.approx(low, abs=2e-3)
    assert band.high == pytest.approx(high, abs=2e-3)


def test_each_condition_has_its_curve_and_none_has_a_part_in_the_variance(made):
    """The difference between conditions is no effect of a parameter: the mass explains all."""
    vary = {"controller.variant": {"each": {"values": ["free", "visco-elastic"]}}} | VARY

    def columns(a):
        return {"settling_time": 10 * a["controller_variant"] + a["body_mass"]}

    figures, by_name = effects_of(made, columns, vary, members=1024)
    (panel,) = figures[EFFECT].panels
    bands, lines = marks_of(panel)
    # Bands of several conditions would cover each other.
    assert bands == []
    assert [(line.label, line.colour) for line in lines] == [("free", 0), ("visco-elastic", 1)]
    assert lines[0].y == pytest.approx(lines[0].x)
    assert lines[1].y == pytest.approx(lines[1].x + 10)
    rows = {row[0].text: row[1].value for row in by_name["sweep-1-influence"].rows}
    assert next(iter(rows)) == "mass"
    assert rows["mass"] == pytest.approx(1, abs=0.01)
    assert "variant" not in rows


def test_a_sum_of_independent_parts_is_divided_by_their_variances(made):
    """For 3 a + 4 b with equally distributed a and b: 9/25 and 16/25 of the variance."""

    def columns(a):
        return {"settling_time": 3 * a["controller_K_r"] + 4 * a["body_mass"]}

    figures, by_name = effects_of(made, columns)
    table = by_name["sweep-1-influence"]
    names = ["mass", "K_r[0] (with all of K_r)", "initial angular_velocity[0]"]
    assert [row[0] for row in texts(table)] == names
    # Twenty groups miss 1/400 of the variance of a term.
    assert [row[1].value for row in table.rows] == pytest.approx([0.64, 0.36, 0], abs=0.01)
    (panel,) = figures["sweep-1-first"].panels
    assert [panel.x.label, panel.y.label] == names[:2]


def test_groups_by_hand():
    groups = np.array([0, 0, 1, 3, 1, 0])
    values = np.array([1.0, 3.0, 8.0, np.nan, np.inf, 2.0])
    # The group means are 2 (three values) and 8 (one), the mean is 3.5: 3 * 1.5² + 4.5² = 27 of 29.
    assert explained(values, groups) == pytest.approx(27 / 29)
    assert explained(groups.astype(float), groups) == pytest.approx(1)
    # Squares of such values would overflow.
    assert explained(1e200 * values, groups) == pytest.approx(27 / 29)
    assert np.isnan(explained(np.ones(6), groups))
    assert np.isnan(explained(np.full(6, np.nan), groups))


def test_chance_and_small_differences_are_no_effect(made):
    noise = np.random.default_rng(2).uniform(1, 2, 4096)

    def columns(a):
        return {"settling_time": noise, "smallest_regularity": 0.8 + 0.004 * a[SPUN]}

    figures, by_name = effects_of(made, columns)
    assert not [name for name in figures if "-effect-" in name]
    assert [head.label for head in by_name["sweep-1-influence"].heads[1:]] == ["settling time of v"]


def test_few_members_have_no_effects(made):
    figures, by_name = effects_of(made, lambda a: {"settling_time": a["body_mass"]}, members=64)
    assert EFFECT not in figures
    assert "sweep-1-influence" not in by_name
