"""Protects the columns of an outcome, for motions in closed form."""

import numpy as np
import pytest

from rbstab.analysis.extrema import Crossings, Extrema
from rbstab.analysis.run_extremes import Extremes
from rbstab.sweep.members.outcome import COLUMNS, MemberTrajectories, outcome_of

TIMES = np.linspace(0.0, 10.0, 201)
PHASES = np.array([0.0, 0.7, 2.0])


def waves(amplitude, decay=0.3, rate=2.0):
    """Return amplitude e^(-decay t) sin(rate t + phase) on three axes, and its derivative."""
    angle = rate * TIMES[:, None] + PHASES
    envelope = amplitude * np.exp(-decay * TIMES)[:, None]
    return envelope * np.sin(angle), envelope * (rate * np.cos(angle) - decay * np.sin(angle))


def trajectories_of(members):
    """Return the traces of one member for each amplitude."""
    E, F = (np.array(part) for part in zip(*(waves(a) for a in members), strict=True))
    Theta = 0.5 * E
    value = np.array([100 * abs(a) * np.exp(-TIMES) for a in members])
    residual = 1e-9 * (np.sin(TIMES) - 0.5) * np.array(members)[:, None]
    return MemberTrajectories(
        time=TIMES,
        orientation=Theta,
        angular_velocity=3 * E,
        position=4 * E,
        velocity=5 * F,
        contact_displacement=E,
        contact_velocity=F,
        lyapunov=value,
        energy_residual=residual,
        energy_at_rest=np.zeros(len(members)),
        energy_round_off=np.full(len(members), 1e-15),
        rest_orientation=Theta[:, -1],
    )


def extremes_of(count):
    """Return extremes of some members, all of them different."""
    numbers = np.arange(8.0)[:, np.newaxis] + 0.1 * np.arange(count)
    extrema = Extrema(-numbers / 8.0, 1.0 + numbers, 1e-9 * numbers)
    settling, near = (Crossings(np.arange(count) + x, np.full(count, 1e-9)) for x in (0.0, 5.0))
    return Extremes(extrema, settling, near)


def test_each_extreme_has_its_column():
    found = outcome_of(trajectories_of([0.2, 0.1]), extremes_of(2))
    assert found["peak_contact_displacement"][1] == pytest.approx([-0.0125, -0.1375, -0.2625])
    assert found["peak_orientation"][1] == pytest.approx([0.3875, 0.5125, 0.6375])
    assert found["smallest_regularity"] == pytest.approx(np.cos([0.5, 0.5125]))
    assert found["peak_contact_displacement_error"] == pytest.approx([2e-9, 2.1e-9])
    assert found["peak_orientation_error"] == pytest.approx([5e-9, 5.1e-9])
    assert found["settling_time"].tolist() == [0.0, 1.0]
    assert found["displacement_settling_time"].tolist() == [5.0, 6.0]
    # Where nothing moves, there is no time of a peak.
    assert found["peak_time"].tolist() == [[0.0] * 3, pytest.approx([1.1, 2.1, 3.1])]


def test_ends_and_residuals():
    members = trajectories_of([0.2, 0.1])
    found = outcome_of(members, extremes_of(2))
    assert found["final_orientation"].tolist() == members.orientation[:, -1].tolist()
    assert found["final_velocity"].tolist() == members.velocity[:, -1].tolist()
    assert found["lyapunov_start"] == pytest.approx([20.0, 10.0])
    assert found["lyapunov_end"] == pytest.approx([20 * np.exp(-10), 10 * np.exp(-10)])
    assert found["energy_residual"] == pytest.approx([3e-10, 1.5e-10], rel=1e-3)
    assert found["energy_scale"] == pytest.approx([20.0, 10.0])
    assert np.isnan(found["final_connector_state"]).all()
    assert set(found) == set(COLUMNS) - {"run_id", "status", "steps"}
