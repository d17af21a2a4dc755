"""Protects what a run with a stop stores, and its certificate, summary and report."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.stops import ANGLE, stop, stopped
from support.switching import ENGINES, INERTIA, data

import rbstab
from rbstab.config.load import load_config
from rbstab.experiment.summary import summary_of
from rbstab.report.model.figure import Points
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.events import events_figure

ARRAYS = {
    "impact_count",
    "impact_loss",
    "stop_contact",
    "stop_angle",
    "impact_time",
    "impact_rate",
    "rest_begin",
    "rest_end",
}
EACH = pytest.mark.parametrize("engine_name", ENGINES)
SPIN = 1.3


def hanging(**integration):
    """Return a held body that its weight presses against its stop."""
    controller = {"variant": "permanent", "K_t": [40.0] * 3, "L_t": [9.0] * 3}
    controller |= {"K_r": [9.0] * 3, "L_r": [3.0] * 3}
    config = data(
        {"end": stop()},
        {"angular_velocity": [0.5, 1.0, -0.3]},
        {"duration": 14.0, "samples": 281} | integration,
        controller=controller,
        gravity=[0.0, 0.0, -9.81],
    )
    config["body"] |= {"contact_point": [-0.8, 0.1, -0.2]}
    return config


@pytest.fixture(scope="module")
def bouncing():
    return rbstab.simulate(load_config(stopped(0.5, SPIN, duration=8.0)))


@pytest.fixture(scope="module")
def resting():
    return rbstab.simulate(load_config(hanging()))


def test_impacts_are_stored(bouncing):
    assert set(bouncing.variables) >= ARRAYS - {"rest_begin", "rest_end"}
    assert not {"rest_begin", "rest_end"} & set(bouncing.variables)
    count = bouncing["impact_count"]
    times = bouncing["impact_time"]
    assert count[-1] == len(times) == 4
    assert (count == np.searchsorted(times, bouncing["time"], side="right")).all()
    np.testing.assert_allclose(bouncing["impact_rate"], SPIN * (-0.5) ** np.arange(4), rtol=1e-12)
    assert float(bouncing["stop_angle"]) == ANGLE
    assert not bouncing["stop_contact"].any()
    assert bouncing["impact"].tolist() == [1, 2, 3, 4]
    dataset = bouncing.to_xarray()
    assert dataset["impact_rate"].dims == ("impact",)
    assert dataset["impact_loss"].attrs["units"] == "J"


def test_energy_balances_with_what_the_impacts_took(bouncing):
    v, lost = bouncing["lyapunov"], bouncing["impact_loss"]
    assert lost[-1] > 0.9 * 0.5 * INERTIA * SPIN**2
    expected = v - v[0] - bouncing["lyapunov_change"] + lost
    np.testing.assert_allclose(bouncing["energy_residual"], expected, atol=1e-15)
    assert np.abs(expected).max() < 1e-12
    assert (bouncing["lyapunov_change"] == 0).all()
    np.testing.assert_allclose(v[0] - v, lost, atol=1e-13)
    assert bouncing.attributes["verdict"] == "consistent"


def test_largest_angle_is_that_of_the_stop(bouncing):
    """The samples are all below it, and the cubics between them are not."""
    assert np.abs(bouncing["orientation"][:, 1]).max() < ANGLE
    assert summary_of(bouncing).largest_pitch == ANGLE
    short = rbstab.simulate(load_config(stopped(0.5, SPIN, duration=0.2)))
    assert short["impact_count"][-1] == 0
    assert summary_of(short).largest_pitch == pytest.approx(0.26, abs=1e-6)


@EACH
def test_certificate_of_a_run_that_ends_at_rest_on_its_stop(engine_name):
    result = rbstab.simulate(load_config(hanging(engine=engine_name)))
    assert result.attributes["verdict"] == "consistent"
    assert result["stop_contact"][-1] == 1
    assert len(result["rest_begin"]) == 1
    assert np.isnan(result["rest_end"]).all()
    # v counts from the rest state against the stop: it ends there.
    assert result["rest_orientation"][1] == ANGLE
    np.testing.assert_allclose(result["rest_orientation"], result["orientation"][-1], atol=1e-4)
    # It is a difference of energies, so it has round-off of either sign.
    assert abs(result["lyapunov"][-1]) < 1e-6 * result["lyapunov"][0]
    # The couple of the stop is that of the element.
    couple = result["element_couple"][:, 0]
    is_resting = result["stop_contact"] == 1
    assert (np.abs(couple[~is_resting]) == 0).all()
    assert (np.linalg.norm(couple[is_resting], axis=1) > 0.1).all()
    assert not result["energy"][:, -1].any()
    assert not result["dissipation"][:, -1].any()


def run_of(result):
    return Run(Path("a.h5"), result, None)


def test_figure_of_the_impacts(bouncing, resting):
    for result, kinds in ((bouncing, {"impact"}), (resting, {"impact", "begin of a rest"})):
        figure = events_figure(run_of(result))
        assert figure is not None
        panels: Any = figure.panels
        pitch, loss, *_ = panels
        points = {
            mark.label: mark for mark in pitch.marks if isinstance(mark, Points) and len(mark.x)
        }
        assert set(points) == kinds
        np.testing.assert_allclose(np.abs(points["impact"].y), ANGLE)
        assert (points["impact"].x == result["impact_time"]).all()
        assert (loss.marks[0].y == result["impact_loss"]).all()


def test_no_figure_without_a_stop():
    config = data({}, {"angular_velocity": [0, 1, 0]}, {"duration": 0.1})
    assert events_figure(run_of(rbstab.simulate(load_config(config)))) is None
