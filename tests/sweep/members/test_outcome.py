"""Protects the columns of an outcome, for motions in closed form."""

import numpy as np
import pytest

from rbstab.analysis.peaks import peaks_at_samples
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
    Theta, rate = 0.5 * E, 0.5 * F
    value = np.array([100 * abs(a) * np.exp(-TIMES) for a in members])
    residual = 1e-9 * (np.sin(TIMES) - 0.5) * np.array(members)[:, None]
    return MemberTrajectories(
        time=TIMES,
        orientation=Theta,
        orientation_rate=rate,
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


@pytest.mark.parametrize("amplitude", [0.2, -0.2])
def test_peaks_are_those_between_the_samples(amplitude):
    """The peaks of e^(-dt) sin(wt + φ) are where tan(wt + φ) = w/d."""
    found = outcome_of(trajectories_of([amplitude]))
    turn = np.arctan2(2.0, 0.3)
    for axis, phase in enumerate(PHASES):
        times = (turn - phase + np.arange(0, 8) * np.pi) / 2.0
        times = times[times >= 0]
        values = amplitude * np.exp(-0.3 * times) * np.sin(2.0 * times + phase)
        best = int(np.abs(values).argmax())
        start = amplitude * np.sin(phase)
        if abs(start) > abs(values[best]):
            values[best], times[best] = start, 0.0
        assert found["peak_contact_displacement"][0, axis] == pytest.approx(values[best], rel=1e-6)
        assert found["peak_time"][0, axis] == pytest.approx(times[best], abs=1e-4)
        assert found["peak_orientation"][0, axis] == pytest.approx(abs(values[best]) / 2, rel=1e-6)
    largest = found["peak_orientation"][0, 1]
    assert largest > 0
    assert found["smallest_regularity"][0] == pytest.approx(np.cos(largest))


def test_settling_times():
    """v = v(0) e^(-t) is a thousandth at ln 1000; |E| settles below 1 mm if it ends there."""
    found = outcome_of(trajectories_of([0.2, 1e-4]))
    assert found["settling_time"] == pytest.approx(np.log(1000), abs=1e-3)
    E, _ = waves(0.2)
    distance = np.linalg.norm(E, axis=1)
    settles = found["displacement_settling_time"]
    assert np.isnan(settles[0]) == (distance[-1] >= 1e-3)
    assert settles[1] == 0.0


def test_what_does_not_settle_has_no_time():
    members = trajectories_of([0.2])
    steady = MemberTrajectories(**{**vars(members), "lyapunov": np.ones((1, len(TIMES)))})
    found = outcome_of(steady)
    assert np.isnan(found["settling_time"][0])


def test_ends_and_residuals():
    members = trajectories_of([0.2, 0.1])
    found = outcome_of(members)
    assert found["final_orientation"].tolist() == members.orientation[:, -1].tolist()
    assert found["final_velocity"].tolist() == members.velocity[:, -1].tolist()
    assert found["lyapunov_start"] == pytest.approx([20.0, 10.0])
    assert found["lyapunov_end"] == pytest.approx([20 * np.exp(-10), 10 * np.exp(-10)])
    assert found["energy_residual"] == pytest.approx([3e-10, 1.5e-10], rel=1e-3)
    assert found["energy_scale"] == pytest.approx([20.0, 10.0])
    assert np.isnan(found["final_connector_state"]).all()
    assert set(found) == set(COLUMNS) - {"run_id", "status", "steps"}


def test_members_do_not_depend_on_each_other():
    together, alone = (
        outcome_of(trajectories_of([0.2, 0.1, 0.3])),
        outcome_of(trajectories_of([0.1])),
    )
    for name, column in alone.items():
        assert column[0].tobytes() == together[name][1].tobytes(), name


@pytest.mark.parametrize("seed", range(20))
def test_the_peak_at_the_samples_is_the_peak_of_all(seed):
    """If the largest peak is next to the largest sample, it is that of the whole polynomial.

    The polynomial is a cubic, so its interpolant is exact; its turning points are roots.
    """
    rng = np.random.default_rng(seed)
    times = np.linspace(0, 1, 12)
    shape = np.polynomial.Polynomial(rng.normal(size=4))
    values, rates = shape(times), shape.deriv()(times)
    peak, when = peaks_at_samples(times, values[None], rates[None])
    turning = shape.deriv().roots()
    inside = turning[np.isreal(turning) & (turning.real > 0) & (turning.real < 1)].real
    candidates = shape(np.concatenate([inside, [0.0, 1.0]]))
    farthest = candidates[np.abs(candidates).argmax()]
    assert peak[0] == pytest.approx(farthest, rel=1e-12)
    assert shape(when[0]) == pytest.approx(peak[0], rel=1e-9, abs=1e-12)
