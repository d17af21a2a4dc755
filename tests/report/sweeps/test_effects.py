"""Protects the effects of parameters: medians and quantiles along them, for known functions."""

import numpy as np
import pytest
from support.made_sweeps import SPIN
from support.sections import figures_in, sweep_sections

from rbstab.report.model.figure import Band, Line

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
    assert "Without an effect beyond chance: factor on K_r." in figure.caption
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
