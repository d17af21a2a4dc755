"""Protects the columns of an outcome: each has its quantity or extreme."""

import numpy as np
import pytest

from rbstab.analysis.extrema import Crossings, Extrema
from rbstab.analysis.run_extremes import E_ROWS, THETA_ROWS, TURN, Extremes
from rbstab.sweep.members.outcome import COLUMNS, outcome_of

TIMES = np.array([0.0, 2.0, 10.0])
SIZES = {"angular_velocity": 3, "position": 4, "velocity": 5, "orientation": 6, "tie.state": 7}


def quantities_of(*members):
    """Return quantities that grow from t = 0, of one member for each rate."""
    growth = np.outer(members, TIMES)
    vectors = {name: size * growth[..., np.newaxis] * [1, 2, 3] for name, size in SIZES.items()}
    return vectors | {
        "time": TIMES,
        "lyapunov": 20.0 - growth,
        "energy_at_rest": -np.array(members),
        "rest_orientation": np.ones((len(members), 3)),
        "rest_unstable": np.arange(len(members)) > 0,
    }


def extremes_of(count):
    """Return extremes of some members, all of them different."""
    numbers = np.arange(9.0)[:, np.newaxis] + 0.1 * np.arange(count)
    extrema = Extrema(-numbers / 9.0, 1.0 + numbers, 1e-9 * numbers)
    extrema.value[TURN] *= -1.0  # a square
    settling, near = (Crossings(np.arange(count) + x, np.full(count, 1e-9)) for x in (0.0, 5.0))
    return Extremes(extrema, settling, near)


def test_each_extreme_has_its_column():
    extremes = extremes_of(2)
    value, time, error = extremes.extrema
    columns = outcome_of(quantities_of(0.2, 0.1), extremes)
    assert (columns["peak_contact_displacement"] == value[E_ROWS].T).all()
    assert (columns["peak_contact_displacement"] <= 0).all()
    assert (columns["peak_orientation"] == -value[THETA_ROWS].T).all()
    assert columns["smallest_regularity"] == pytest.approx(np.cos(value[THETA_ROWS][1]))
    assert (columns["peak_contact_displacement_error"] == error[E_ROWS][2]).all()
    assert (columns["peak_orientation_error"] == error[THETA_ROWS][2]).all()
    tilts, ends = (2 * np.arcsin(np.sqrt(s)) for s in (value[TURN], value[TURN] + error[TURN]))
    assert columns["peak_tilt"] == pytest.approx(tilts, rel=1e-12)
    assert columns["peak_tilt"] + columns["peak_tilt_error"] == pytest.approx(ends, rel=1e-12)
    assert columns["settling_time"].tolist() == [0.0, 1.0]
    assert columns["displacement_settling_time"].tolist() == [5.0, 6.0]
    # Where nothing moves, there is no time of a peak.
    assert columns["peak_time"].tolist() == [[0.0] * 3, time[E_ROWS, 1].tolist()]


def test_ends():
    columns = outcome_of(quantities_of(0.2, 0.1), extremes_of(2))
    for name, size in SIZES.items():
        expected = [[2.0 * size, 4.0 * size, 6.0 * size], [size, 2.0 * size, 3.0 * size]]
        np.testing.assert_allclose(columns[f"final_{name}"], expected)
    assert columns["end_time"].tolist() == [10.0, 10.0]
    assert columns["lyapunov_start"].tolist() == [20.0, 20.0]
    assert columns["lyapunov_end"].tolist() == [18.0, 19.0]
    assert columns["energy_at_rest"].tolist() == [-0.2, -0.1]
    assert columns["rest_unstable"].tolist() == [False, True]
    by_engines = {"status", "steps", "energy_residual", "energy_scale"}
    # A body without a connector has no state of it.
    assert set(COLUMNS) - set(columns) == by_engines | {"final_connector_state"}
    assert set(columns) - set(COLUMNS) == {"final_tie.state"}
