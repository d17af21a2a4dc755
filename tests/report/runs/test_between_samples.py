"""Protects the interpolation of phase portraits: it follows the exact motion between samples."""

import numpy as np
import pytest
from support.figure_runs import cut, lines_of, run_of, with_arrays, without_config

import rbstab
from rbstab.config.load import changed_config, resolved
from rbstab.report.model.figure import Points
from rbstab.report.runs.figures import between_samples
from rbstab.report.runs.figures.between_samples import path_between_samples
from rbstab.report.runs.figures.phase import overlaid_phases, phase_figure

KINDS = ("permanent", "visco-elastic", "embedded", "free", "manifold")


def thinned(run, step):
    """Return a run with every so many of its samples."""
    return with_arrays(
        run,
        **{
            name: variable.data[::step]
            for name, variable in run.result.variables.items()
            if variable.dimensions[:1] == ("time",)
        },
    )


@pytest.mark.parametrize("kind", KINDS)
def test_points_between_samples_are_on_the_motion(kind, monkeypatch):
    """The run with eight times as many samples is the independent solution."""
    run = run_of(kind)
    config = run.config
    assert config is not None
    data = resolved(config)
    data["integration"]["samples"] = 8 * (config.integration.samples - 1) + 1
    fine = rbstab.simulate(changed_config(config, data))
    monkeypatch.setattr(between_samples, "VISIBLE", 0.0)
    path = path_between_samples(run)
    assert path.cubics == path.intervals == len(run.result["time"]) - 1
    for name in ("orientation", "angular_velocity"):
        drawn, exact = getattr(path, name), fine[name]
        straight = np.column_stack(
            [np.interp(fine["time"], run.result["time"], c) for c in run.result[name].T]
        )
        errors = [np.abs(found - exact).max() for found in (drawn, straight)]
        # h⁴/384 times the fourth derivative, over h²/8 times the second: with h = 5 ms, a
        # thirtieth for the stiffest of these runs.
        assert errors[0] < 0.05 * errors[1]


def test_a_cubic_that_breaks_the_equations_is_not_drawn():
    run = run_of("visco-elastic")
    wrong = with_arrays(run, velocity=run.result["velocity"] * 40)
    path = path_between_samples(wrong)
    assert path.cubics < path.intervals
    sparse = thinned(run, 20)
    path = path_between_samples(sparse)
    assert path.cubics < path.intervals
    assert "straight" in phase_figure(sparse).caption


@pytest.mark.parametrize("kind", ["sliding", "unreadable"])
def test_runs_whose_equations_change_are_joined_by_straight_lines(kind):
    run = run_of("sliding") if kind == "sliding" else without_config(run_of("free"))
    path = path_between_samples(run)
    assert path.cubics == 0
    np.testing.assert_array_equal(path.orientation, run.result["orientation"])
    assert phase_figure(run).caption.startswith("Samples are joined by straight lines.")


def test_a_run_of_one_sample_has_a_portrait():
    path = path_between_samples(cut(run_of("free"), 1))
    assert (path.cubics, path.intervals, len(path.orientation)) == (0, 0, 1)


def test_runs_of_one_body_have_one_rest_state_and_their_own_starts():
    runs = [run_of("free"), run_of("free", 1, "again"), run_of("permanent", 2)]
    figure = overlaid_phases(runs)
    for component, panel in enumerate(figure.panels):
        assert [line.label for line in lines_of(panel)] == ["free", "again", "permanent"]
        points = [mark for mark in panel.marks if isinstance(mark, Points)]
        starts = [mark for mark in points if mark.label == "start"]
        rest = [mark for mark in points if mark.label == "rest state"]
        assert len(starts) + len(rest) == len(points)
        expected = [run.result["orientation"][0, component] for run in runs]
        assert [mark.x.tolist() for mark in starts] == [[place] for place in expected]
        rests = {round(float(run.result["rest_orientation"][component]), 9) for run in runs}
        assert sorted(float(mark.x[0]) for mark in rest) == sorted(rests)
        assert all((mark.y == 0).all() for mark in rest)
