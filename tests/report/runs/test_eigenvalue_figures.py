"""Protects the figures of eigenvalues and root loci of runs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.figure_runs import lines_of, run_of, without_config
from support.sections import figures_in

import rbstab
from rbstab.report.model.document import Section
from rbstab.report.model.figure import Level, Points
from rbstab.report.model.palette import COLOURS
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures import eigenvalues
from rbstab.report.runs.figures.eigenvalues import MAX_LOCI, eigenvalue_blocks
from rbstab.report.runs.figures.spectra import Roots


def blocks_of(*runs):
    blocks = eigenvalue_blocks(runs)
    text = " ".join(block for block in blocks if isinstance(block, str))
    return figures_in((Section("s", "S", blocks),)), text


def points_of(panel):
    return {mark.label: mark for mark in panel.marks if isinstance(mark, Points)}


def values(points):
    return points.x + 1j * points.y


def translations(config, factor=1.0):
    """Return the roots of m s² + L_t s + K_t of each axis: the translation of a free body."""
    controller = config.controller
    pairs = zip(controller.L_t, controller.K_t, strict=True)
    return np.concatenate([np.roots([config.body.mass, L, factor * K]) for L, K in pairs])


def test_the_eigenvalues_of_a_free_body_are_those_of_its_oscillators():
    run = run_of("free")
    figures, text = blocks_of(run)
    every, slow = figures["runs-eigenvalues"].panels
    found = values(points_of(every)["free"])
    assert len(found) == 12
    for expected in translations(run.config):
        assert np.abs(found - expected).min() < 1e-6 * abs(expected)
    seen = values(points_of(slow)["free"])
    assert set(seen.tolist()) <= set(found.tolist())
    assert -seen.real.min() <= 10 * -seen.real.max()
    assert text == ""


def test_zero_is_marked_as_the_border():
    figures, _ = blocks_of(run_of("free"))
    for figure in figures.values():
        for panel in figure.panels:
            (border,) = [mark for mark in panel.marks if isinstance(mark, Level)]
            assert border == Level(0.0, "border of stability", vertical=True)
            assert (panel.x.text, panel.y.text) == (
                "real part Re λ [1/s]",
                "imaginary part Im λ [1/s]",
            )


def test_a_locus_goes_through_the_gain_as_it_is():
    run = run_of("free")
    figures, _ = blocks_of(run)
    nominal = values(points_of(figures["runs-eigenvalues"].panels[0])["free"])
    panel = figures["run-1-locus"].panels[0]
    marked = points_of(panel)
    here = values(marked["K_r as configured"])
    assert np.sort_complex(here) == pytest.approx(np.sort_complex(nominal), rel=1e-6)
    for branch in range(12):
        line = lines_of(panel)[branch]
        ends = [values(marked[f"K_r times {factor}"])[branch] for factor in (0.1, 10)]
        assert [line.x[0] + 1j * line.y[0], line.x[-1] + 1j * line.y[-1]] == ends
        assert (
            np.abs(line.x + 1j * line.y - here[branch]).min(where=line.x < np.inf, initial=9) == 0
        )


def test_no_straight_line_joins_a_real_and_a_complex_eigenvalue():
    figures, _ = blocks_of(run_of("embedded"))
    lines = lines_of(figures["run-1-locus"].panels[0])
    for line in lines:
        joined = np.isfinite(line.y[1:]) & np.isfinite(line.y[:-1])
        assert ((line.y[1:] == 0) == (line.y[:-1] == 0))[joined].all()
    assert any(np.isnan(line.x).any() for line in lines)


def test_a_config_that_cannot_be_read_is_left_out_with_a_sentence():
    figures, text = blocks_of(without_config(run_of("free")), run_of("permanent", 1))
    assert set(figures) == {"runs-eigenvalues", "run-2-locus"}
    assert set(points_of(figures["runs-eigenvalues"].panels[0])) == {"permanent"}
    assert "cannot read" in text
    assert text.endswith("free.")


def test_where_nothing_can_be_computed_there_is_a_sentence(monkeypatch):
    def fails(config, key, factors):
        raise np.linalg.LinAlgError("no convergence")

    monkeypatch.setattr(eigenvalues, "root_locus", fails)
    figures, text = blocks_of(run_of("free"))
    assert not figures
    assert text == (
        "No eigenvalues are drawn where no rest state was found in the range of eq. 5, or where "
        "a force that jumps holds the body at rest: free."
    )


def test_of_many_runs_the_first_have_loci():
    runs = [run_of("sliding", number, f"run {number}") for number in range(MAX_LOCI + 1)]
    figures, text = blocks_of(*runs)
    assert len(figures) == 1 + MAX_LOCI
    # All have the same eigenvalues.
    (label,) = points_of(figures["runs-eigenvalues"].panels[0])
    assert label == f"{', '.join(run.label for run in runs[:6])} and {len(runs) - 6} more"
    assert f"the first {MAX_LOCI} runs" in text


def test_both_of_a_pair_are_slow_or_neither_is():
    figures, _ = blocks_of(run_of("visco-elastic"))
    lines = lines_of(figures["run-1-locus"].panels[1])
    x, y = (np.concatenate([getattr(line, side) for line in lines]) for side in "xy")
    assert (y > 0).sum() == (y < 0).sum() > 0
    slowest = -points_of(figures["runs-eigenvalues"].panels[0])["visco-elastic"].x.max()
    assert 5 * slowest < -np.nanmin(x) <= 10 * slowest * (1 + 1e-6)


def given_spectra(monkeypatch, *spectra):
    """Let the eigenvalues of the runs be given, in their order."""
    waiting = iter(spectra)

    def given(run, factors):
        return Roots(run, np.ones(1), np.array([next(waiting)], dtype=complex))

    monkeypatch.setattr(eigenvalues, "_roots", given)


def test_runs_are_told_apart(monkeypatch):
    given_spectra(monkeypatch, *([-1.0 - n, -3.0 - n] for n in range(10)))
    runs = [run_of("free", number, f"run {number}") for number in range(10)]
    panel = blocks_of(*runs)[0]["runs-eigenvalues"].panels[0]
    marks = list(points_of(panel).values())
    looks = {(mark.colour % len(COLOURS), mark.symbol) for mark in marks}
    assert len(looks) == len(runs)
    assert len({mark.symbol for mark in marks[:6]}) == 6
    # A disc would hide the symbols below it.
    assert all(mark.symbol != 0 for mark in marks)


def test_runs_with_the_same_eigenvalues_have_one_entry(monkeypatch):
    given_spectra(monkeypatch, [-1, -2 + 3j, -2 - 3j], [-2 - 3j, -1, -2 + 3j], [-1, -2 + 3j, -4])
    runs = [run_of("free", number, f"g{number}") for number in range(3)]
    figure = blocks_of(*runs)[0]["runs-eigenvalues"]
    assert list(points_of(figure.panels[0])) == ["g0, g1", "g2"]
    assert "one entry" in figure.caption


def test_an_eigenvalue_that_is_far_away_is_named_and_does_not_squeeze_the_others(monkeypatch):
    given_spectra(monkeypatch, [-1, -2 + 3j, -2 - 3j, -4, -53210], [-2, -3, -2 + 2j, -2 - 2j, -4])
    runs = [run_of("free", number, f"g{number}") for number in range(2)]
    figure = blocks_of(*runs)[0]["runs-eigenvalues"]
    drawn = np.concatenate([mark.x for mark in points_of(figure.panels[0]).values()])
    assert sorted(drawn) == [-4, -4, -3, -2, -2, -2, -2, -2, -1]
    assert figure.panels[0].x.label == "real part Re λ, without those far away"
    assert "λ = -5.321e+04 1/s (g0)" in figure.caption


def test_eigenvalues_that_are_real_to_round_off_are_drawn_as_real(monkeypatch):
    pair, far = -24.42 + 2.919e-14j, -53210 + 1e-11j
    given_spectra(monkeypatch, [-30, -40, -50, -60, pair, pair.conjugate(), far, far.conjugate()])
    figure = blocks_of(run_of("free"))[0]["runs-eigenvalues"]
    (points,) = points_of(figure.panels[0]).values()
    assert not points.y.any()
    assert "λ = -24.42 1/s, ζ = 1" in points.texts
    assert "λ = -5.321e+04 (twice) 1/s (free)" in figure.caption


def test_the_modes_of_a_sliding_surface_are_said_to_be_missing():
    _, text = blocks_of(run_of("sliding"), run_of("free", 1))
    assert "exp(-κt)" in text
    assert "sliding (κ = 20 1/s)" in text
    assert "free" not in text


def run_from(config: dict, label: str) -> Run:
    """Return a run of a config of its own."""
    loaded = rbstab.load_config(config)
    return Run(0, "run-1", label, Path(f"{label}.h5"), rbstab.simulate(loaded), loaded)


def test_a_body_without_a_controller_has_eigenvalues_but_no_locus():
    """A tie at the centre of gravity: m s² + L_c s + K_c on each axis, as a free oscillator."""
    mass, stiffness, damping = 12.0, (4000.0, 5000.0, 6000.0), (150.0, 160.0, 200.0)
    at_centre = {"point": [0, 0, 0], "anchor": [0, 0, 0], "K_c": stiffness, "L_c": damping}
    run = run_from(
        {
            "schema_version": 2,
            "body": {"mass": mass, "inertia": [0.29, 0.34, 0.13], "contact_point": [0, 0, 0]},
            "elements": {
                "tie": {"kind": "visco-elastic", **at_centre},
                "upright": {"kind": "attitude", "K": [60, 60, 40], "L": [6, 6, 4]},
            },
            "initial": {"angular_velocity": [1, 0, 0]},
            "integration": {"duration": 0.1, "samples": 3},
        },
        "tied",
    )
    figures, text = blocks_of(run)
    assert set(figures) == {"runs-eigenvalues"}
    assert text == ""
    found = values(points_of(figures["runs-eigenvalues"].panels[0])["tied"])
    for K, L in zip(stiffness, damping, strict=True):
        for expected in np.roots([mass, L, K]):
            assert np.abs(found - expected).min() < 1e-6 * abs(expected)


@pytest.mark.parametrize(("fastest", "titles"), [(13.0, [""]), (30.0, ["all", "slow"])])
def test_a_second_panel_must_show_a_smaller_range(monkeypatch, fastest, titles):
    """Slow eigenvalues decay at up to 10 1/s here, so that a panel of them ends there."""
    spectrum = np.array([-1.0, -10.0, -2 + 3j, -2 - 3j, -fastest])

    def given(run, factors):
        return Roots(run, np.asarray(factors), np.tile(spectrum, (len(factors), 1)))

    monkeypatch.setattr(eigenvalues, "_roots", given)
    figures, _ = blocks_of(run_of("free"))
    for name in ("runs-eigenvalues", "run-1-locus"):
        assert [p.title.removesuffix(" eigenvalues") for p in figures[name].panels] == titles
        (first, *_) = figures[name].panels
        assert -fastest in np.concatenate([points.x for points in points_of(first).values()])


def test_zero_eigenvalues_of_a_body_on_its_stop_are_explained(monkeypatch):
    """Gravity holds a forearm against its stop, so θ2 and its rate stay as they are."""
    # A rest state on a stop takes long to find, and a locus has 41 of them.
    monkeypatch.setattr(eigenvalues, "FACTORS", np.ones(1))
    config: dict[str, Any] = {
        "schema_version": 2,
        "body": {"mass": 1.5, "inertia": [0.002, 0.01, 0.01], "contact_point": [-0.14, 0, 0]},
        "gravity": [0, 0, -9.81],
        "controller": {
            "variant": "permanent",
            "K_t": [2] * 3,
            "L_t": [0.1] * 3,
            "K_r": [0.5] * 3,
            "L_r": [0.02] * 3,
        },
        "elements": {"bone": {"kind": "guard", "method": "stop", "angle": 0.9, "restitution": 0.6}},
        "integration": {"duration": 0.1, "samples": 3},
    }
    figures, text = blocks_of(run_from(config, "on the bone"))
    every = values(points_of(figures["runs-eigenvalues"].panels[0])["on the bone"])
    assert np.count_nonzero(every == 0) == 2
    # Zero does not decay, so all eigenvalues count as slow: a second panel would be the same.
    for name in ("runs-eigenvalues", "run-1-locus"):
        (panel,) = figures[name].panels
        assert panel.title == ""
        assert "low eigenvalues" not in figures[name].caption
    assert "a stop holds θ2 at rest" in text
    assert text.endswith("on the bone.")
    # With strong muscles it rests before the stop, and nothing needs to be explained.
    config["controller"]["K_r"] = [500] * 3
    assert blocks_of(run_from(config, "strong"))[1] == ""


def test_what_does_not_decay_is_never_left_out_nor_merged(monkeypatch):
    stable, unstable = [-1 + 1j, -1 - 1j, -2.0, -3.0], [-1.1 + 1j, -1.1 - 1j, -2.0, 500.0]
    given_spectra(monkeypatch, stable, unstable)
    panel = blocks_of(run_of("free"), run_of("free", 1, "other"))[0]["runs-eigenvalues"].panels[0]
    assert 500.0 in points_of(panel)["other"].x
    slow, growing = [-0.005, -2 + 1j, -2 - 1j, -1e4], [0.005, -2 + 1j, -2 - 1j, -1e4]
    given_spectra(monkeypatch, slow, growing)
    panel = blocks_of(run_of("free"), run_of("free", 1, "other"))[0]["runs-eigenvalues"].panels[0]
    assert 0.005 in points_of(panel)["other"].x
    assert set(points_of(panel)) == {"free", "other"}


def test_a_run_of_which_all_eigenvalues_are_large_is_drawn(monkeypatch):
    usual = [[-1.0 - k, -2.0 - k] for k in range(3)]
    given_spectra(monkeypatch, *usual, [-1e4, -2e4])
    runs = [run_of("free", number, f"run {number}") for number in range(4)]
    panel = blocks_of(*runs)[0]["runs-eigenvalues"].panels[0]
    assert points_of(panel)["run 3"].x.tolist() == [-1e4, -2e4]


def test_slow_eigenvalues_that_differ_are_not_merged_beside_fast_ones(monkeypatch):
    given_spectra(monkeypatch, [-0.005, -2.0, -3.0, -1e4], [-0.006, -2.0, -3.0, -1e4])
    panel = blocks_of(run_of("free"), run_of("free", 1, "other"))[0]["runs-eigenvalues"].panels[0]
    assert set(points_of(panel)) == {"free", "other"}
