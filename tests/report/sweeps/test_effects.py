"""Protects the effects of parameters: medians and quantiles along them, for known functions."""

import numpy as np
import pytest
from support.made_sweeps import SPIN
from support.sections import figures_in, sweep_sections

from rbstab.report.model.figure import Axis, Band, Line
from rbstab.report.sweeps.maps.effects import _groups_of
from rbstab.report.sweeps.parameters import Parameter

VARY = {
    "body.mass": {"uniform": [1, 2]},
    f"{SPIN}[0]": {"uniform": [0, 1]},
    "controller.K_r": {"scale": {"uniform": [0, 1]}},
}
DESIGN = {"design": "sobol", "members": 4096, "seed": 1}


def marks_of(panel):
    band = [mark for mark in panel.marks if isinstance(mark, Band)]
    line = [mark for mark in panel.marks if isinstance(mark, Line)]
    return band, line


def test_the_median_and_the_band_are_those_of_the_other_parameter(made):
    """For t = 4 m + u with u uniform on 0 to 1: median 4 m + 1/2, band 4 m + 0.05 to 4 m + 0.95.

    A group is 1/20 of the range of m wide, which moves the quantiles by at most 0.05 * 4 / 2.
    """

    def columns(a):
        return {"settling_time": 4 * a["body_mass"] + a["initial_angular_velocity_0"]}

    figure = figures_in(sweep_sections(made(VARY, columns, **DESIGN)))[
        "sweep-1-effect-settling-time"
    ]
    assert figure.shared == "y"
    # The parameter with more influence is first, the one without any is left out.
    assert [p.x.label for p in figure.panels] == ["mass", "initial angular_velocity[0]"]
    assert "Without an effect beyond chance: K_r[0] (with all of K_r)." in figure.caption
    (band,), (line,) = marks_of(figure.panels[0])
    assert len(line.x) == 20
    assert (np.diff(line.x) > 0).all()
    assert line.y == pytest.approx(4 * line.x + 0.5, abs=0.06)
    assert band.low == pytest.approx(4 * line.x + 0.05, abs=0.1)
    assert band.high == pytest.approx(4 * line.x + 0.95, abs=0.1)


def test_the_share_of_an_outcome_has_wilsons_interval(made):
    def columns(a):
        return {
            "settling_time": np.where(
                a["initial_angular_velocity_0"] < a["body_mass"] - 1, 1, np.nan
            )
        }

    figure = figures_in(sweep_sections(made(VARY, columns, **DESIGN)))["sweep-1-effect-outcome"]
    mass = next(p for p in figure.panels if p.x.label == "mass")
    (band,), (line,) = marks_of(mass)
    # Of members with a mass m, a share m - 1 has a smaller spin.
    assert line.y == pytest.approx(line.x - 1, abs=0.03)
    n, z = 4096 / 20, 1.959964
    centre = (line.y + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(line.y * (1 - line.y) / n + z**2 / (4 * n**2))
    assert band.low == pytest.approx(centre - half, abs=2e-3)
    assert band.high == pytest.approx(centre + half, abs=2e-3)


def test_each_condition_has_its_curve(made):
    vary = {"controller.variant": {"each": {"values": ["free", "visco-elastic"]}}} | VARY
    design = DESIGN | {"members": 1024}

    def columns(a):
        return {"settling_time": 10 * a["controller_variant"] + a["body_mass"]}

    figure = figures_in(sweep_sections(made(vary, columns, **design)))[
        "sweep-1-effect-settling-time"
    ]
    (panel,) = figure.panels
    bands, lines = marks_of(panel)
    assert [line.label for line in lines] == ["free", "visco-elastic"]
    assert len(bands) == 2
    assert lines[0].y == pytest.approx(lines[0].x)
    assert lines[1].y == pytest.approx(lines[1].x + 10)
    # The table of influence has all members together, so its order may be another one.
    assert "first, in the condition where it explains most" in figure.caption


FIVE = {"body.mass": {"each": {"values": [1.0, 2.0, 3.0, 4.0, 5.0]}}}
OTHERS = {key: value for key, value in VARY.items() if key != "body.mass"}
SPUN = "initial_angular_velocity_0"


def effect_of_spin(made, settling, values=FIVE):
    """The figure of a sweep with conditions along the mass, whose time depends on spin and gain."""
    sweep = made(values | OTHERS, lambda a: {"settling_time": settling(a)}, **DESIGN | SMALL)
    return figures_in(sweep_sections(sweep))["sweep-1-effect-settling-time"]


SMALL = {"members": 1024}


def test_bands_that_cover_each_other_have_panels_of_their_own(made):
    """Five conditions with nearly the same quantiles: s + u, with a tenth of the mass."""
    figure = effect_of_spin(made, lambda a: a[SPUN] + a["controller_K_r"] + 0.1 * a["body_mass"])
    assert figure.small
    assert (figure.columns, figure.shared) == (5, "y")
    names = [f"mass = {k} kg" for k in range(1, 6)]
    # A row of panels for each of both parameters.
    assert [panel.title for panel in figure.panels] == 2 * names
    assert len({panel.x.label for panel in figure.panels[:5]}) == 1
    for k, panel in enumerate(figure.panels[:5]):
        (band,), (line,) = marks_of(panel)
        assert band.colour == line.colour == k
        assert line.y == pytest.approx(line.x + 0.5 + 0.1 * (k + 1), abs=0.1)
        assert band.low == pytest.approx(line.x + 0.05 + 0.1 * (k + 1), abs=0.12)
        assert band.high == pytest.approx(line.x + 0.95 + 0.1 * (k + 1), abs=0.12)


def test_bands_that_are_apart_share_a_panel(made):
    figure = effect_of_spin(made, lambda a: a[SPUN] + a["controller_K_r"] + 10 * a["body_mass"])
    assert not figure.small
    assert len(figure.panels) == 2
    for panel in figure.panels:
        bands, lines = marks_of(panel)
        assert len(bands) == len(lines) == 5


def test_many_conditions_show_the_parameter_that_explains_most(made):
    eight = {"body.mass": {"each": {"values": [float(k) for k in range(1, 9)]}}}
    figure = effect_of_spin(made, lambda a: 2 * a[SPUN] + a["controller_K_r"], eight)
    assert {panel.x.label for panel in figure.panels} == {"initial angular_velocity[0]"}
    assert (len(figure.panels), figure.columns) == (8, 4)
    assert "Smaller effects: K_r[0] (with all of K_r)." in figure.caption


def test_a_condition_without_a_value_has_no_panel(made):
    def settling(a):
        return a[SPUN] + a["controller_K_r"]

    sweep = made(
        FIVE | OTHERS,
        lambda a: {
            "settling_time": settling(a),
            "smallest_regularity": np.where(a["body_mass"] == 2, np.nan, settling(a)),
        },
        **DESIGN | SMALL,
    )
    figure = figures_in(sweep_sections(sweep))["sweep-1-effect-regularity"]
    assert [panel.title for panel in figure.panels[:4]] == [f"mass = {k} kg" for k in (1, 3, 4, 5)]
    assert [marks_of(panel)[1][0].colour for panel in figure.panels[:4]] == [0, 2, 3, 4]


def test_chance_and_small_differences_are_no_effect(made):
    noise = np.random.default_rng(2).uniform(1, 2, 4096)

    def columns(a):
        return {
            "settling_time": noise,
            "smallest_regularity": 0.8 + 0.004 * a["initial_angular_velocity_0"],
        }

    sections = sweep_sections(made(VARY, columns, **DESIGN))
    assert not [name for name in figures_in(sections) if "-effect-" in name]
    texts = [b for s in sections for b in s.blocks if isinstance(b, str)]
    assert any("settling time of v: no parameter has an effect beyond chance" in t for t in texts)
    assert any("smallest cos θ2" in t and "less than 1% apart" in t for t in texts)


def test_few_members_have_no_effects(made):
    sweep = made(VARY, lambda a: {"settling_time": a["body_mass"]}, **(DESIGN | {"members": 64}))
    assert not [name for name in figures_in(sweep_sections(sweep)) if "-effect-" in name]


def test_conditions_share_the_groups_of_equal_values_only():
    values = np.concatenate([np.arange(400.0), np.arange(400.0), np.arange(400.0)[::-1]])
    parameter = Parameter("x", "x", Axis("x"), values, listed=False)
    first, second, third = _groups_of(parameter, list(np.arange(1200).reshape(3, 400)))
    assert first is second
    assert third.of_member.tolist() == first.of_member[::-1].tolist()
