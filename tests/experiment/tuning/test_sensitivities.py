"""Protects the sensitivities of a run against finite differences and a closed solution."""

import numpy as np
import pytest
from scipy.optimize import brentq
from support.outcomes import differences, quantities
from support.stored_differences import (
    CASES,
    METHODS,
    SMOOTH_CASES,
    SWITCHING_CASES,
    stored_differences,
)

from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError, sensitivities
from rbstab.integrate.status import RunStatus, UnfinishedRunError

ERROR = 1e-6

NOISE = 1e-9
"""The error of finite differences, relative to the largest effect on the same quantity."""

ALL = [
    name if name == "visco-elastic-W-equilibrium" else pytest.param(name, marks=pytest.mark.slow)
    for name in SMOOTH_CASES
]
"""Only the case with the longest chain rule is not slow: each structure compiles for seconds."""


@pytest.mark.parametrize("name", ALL)
def test_every_derivative_is_that_of_differences_of_runs(name):
    compare_with_differences(name)


@pytest.mark.heavy
@pytest.mark.parametrize("name", SWITCHING_CASES)
def test_every_derivative_through_switches_is_that_of_differences_of_runs(name):
    compare_with_differences(name)


def compare_with_differences(name):
    """Compare all derivatives of a case with stored differences of runs."""
    data = CASES[name]
    found = sensitivities(data)
    np.testing.assert_allclose(
        quantities(data, found, METHODS[name]), found.values, rtol=0, atol=1e-9
    )
    settles = np.isfinite(found.values)
    assert settles[1:].all()
    assert np.isfinite(found.derivatives[:, settles]).all()
    expected = stored_differences(name, found)
    # Each derivative is scaled by the size of its number, so that effects can be compared.
    sizes = np.array([[abs(entry.value) or 1.0] for entry in found.entries])
    actual, expected = (found.derivatives * sizes)[:, settles], (expected * sizes)[:, settles]
    allowed = ERROR * np.abs(expected) + NOISE * np.abs(expected).max(axis=0)
    off = np.argwhere(np.abs(actual - expected) > allowed)
    assert not [(found.entries[i].key, found.quantities[j].name) for i, j in off]


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_the_stored_differences_are_those_of_runs(name):
    found = sensitivities(CASES[name])
    expected = stored_differences(name, found)
    sizes = np.array([[abs(entry.value) or 1.0] for entry in found.entries])
    allowed = NOISE * np.abs(expected * sizes).max(axis=0)
    off = np.abs(differences(CASES[name], found, METHODS[name]) - expected) * sizes
    has_value = np.isfinite(found.values)
    assert np.all((off <= allowed)[:, has_value])


# A body that only translates is a damped oscillator: m ẍ + l ẋ + k x = m g.
OSCILLATOR = {
    "body.mass": 4.0,
    "controller.K_t[2]": 100.0,
    "controller.L_t[2]": 9.0,
    "initial.position[2]": 0.3,
    "initial.velocity[2]": 1.7,
}
FALL = -9.81
DURATION = 5.0


def oscillator_config(m, k, damping, x, v):
    return {
        "body": {"mass": m, "inertia": [2.0, 1.5, 1.0], "contact_point": [0.15, 0.1, -0.42]},
        "gravity": [0, 0, FALL],
        "controller": {
            "variant": "free",
            "K_t": [100, 100, k],
            "L_t": [20, 20, damping],
            "K_r": [40, 40, 40],
            "L_r": [6, 6, 6],
        },
        "initial": {"position": [0, 0, x], "velocity": [0, 0, v]},
        "integration": {"duration": DURATION},
    }


def swing(numbers, t):
    """Return the textbook x - x_rest and ẋ, for real or complex parameters."""
    m, k, damping, x, v = numbers
    c, a = damping / (2 * m), x - m * FALL / k
    w = np.sqrt(k / m - c * c)
    b = (v + c * a) / w
    decay, cos, sin = np.exp(-c * t), np.cos(w * t), np.sin(w * t)
    return decay * (a * cos + b * sin), decay * ((b * w - c * a) * cos - (a * w + c * b) * sin)


def closed_solution(numbers):
    """Return the settling time, the peak, its time, and the final position and velocity."""
    m, k, damping, x, v = numbers
    c, a = damping / (2 * m), x - m * FALL / k
    w = np.sqrt(k / m - c * c)
    b = (v + c * a) / w
    # The motion starts upwards; the lower turning point, half a period later, is farther from zero.
    turning = (np.arctan((b * w - c * a) / (a * w + c * b)) + np.pi) / w

    def excess(t):
        value = [0.5 * k * p * p + 0.5 * m * q * q for p, q in (swing(numbers, t), (a, v))]
        return value[0] - 1e-3 * value[1]

    real = [np.real(number) for number in numbers]

    def real_excess(t):
        (p, q), start = swing(real, t), swing(real, 0.0)
        energies = [0.5 * real[1] * y * y + 0.5 * real[0] * z * z for y, z in ((p, q), start)]
        return energies[0] - 1e-3 * energies[1]

    settling = brentq(real_excess, 0.5, DURATION, xtol=1e-14)
    for _ in range(3):
        # v' = -l ẋ²; Newton's steps also converge in the imaginary part.
        settling = settling + excess(settling) / (damping * swing(numbers, settling)[1] ** 2)
    rest = m * FALL / k
    end = swing(numbers, DURATION)
    return np.array([settling, rest + swing(numbers, turning)[0], turning, rest + end[0], end[1]])


def test_an_oscillator_has_the_derivatives_of_its_closed_solution():
    numbers = np.array(list(OSCILLATOR.values()))
    found = sensitivities(oscillator_config(*numbers))
    names = (
        "settling_time",
        "peak_contact_displacement[2]",
        "peak_time[2]",
        "final.position[2]",
        "final.velocity[2]",
    )
    columns = [found.column(name) for name in names]
    np.testing.assert_allclose(found.values[columns], closed_solution(numbers), rtol=1e-11)
    keys = [entry.key for entry in found.entries]
    for key, direction in zip(OSCILLATOR, np.eye(5), strict=True):
        expected = closed_solution(numbers + 1e-100j * direction).imag / 1e-100
        actual = found.derivatives[keys.index(key), columns]
        np.testing.assert_allclose(actual, expected, rtol=1e-9)


def test_sensitivities_show_what_they_are_and_the_most_influential_numbers():
    found = sensitivities(oscillator_config(*OSCILLATOR.values()))
    count = f"{len(found.entries)} numbers, {len(found.quantities)} quantities"
    assert repr(found) == f"<rbstab.Sensitivities: {count}>"
    page = found._repr_html_()
    first, *_ = found.by_importance(["settling_time"])
    assert count in page
    assert f"p/q ∂q/∂p, {found.entries[first].key}" in page
    assert f"{found.relative[first, found.column('settling_time')]:.3g}" in page
    with pytest.raises(ValueError, match=r"no quantity 'settling' \(expected one of .*settling_t"):
        found.column("settling")


def test_a_run_that_does_not_settle_has_no_settling_time():
    data = oscillator_config(*OSCILLATOR.values())
    data["integration"]["duration"] = 0.2
    found = sensitivities(data)
    column = found.column("settling_time")
    assert "settling_time" not in found._repr_html_()
    assert np.isnan(found.values[column])
    assert np.isnan(found.derivatives[:, column]).all()
    assert np.isfinite(np.delete(found.derivatives, column, axis=1)).all()


def test_a_peak_at_an_end_of_the_run_stays_there():
    data = oscillator_config(*OSCILLATOR.values())
    data["initial"]["velocity"] = [0, 0, 0]
    data["gravity"] = [0, 0, 0]
    found = sensitivities(data)
    row = found.derivatives[[e.key for e in found.entries].index("initial.position[2]")]
    assert found.values[found.column("peak_time[2]")] == 0.0
    assert row[found.column("peak_time[2]")] == 0.0
    assert row[found.column("peak_contact_displacement[2]")] == pytest.approx(1.0, rel=1e-12)


def test_a_motion_that_drifts_is_refused():
    data = oscillator_config(*OSCILLATOR.values())
    del data["initial"]
    data["controller"] |= {"variant": "permanent"}
    data["integration"]["coordinates"] = "manifold"
    with pytest.raises(UnsuitedConfigError, match="manifold"):
        sensitivities(data)


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({"range_bound": 0.999}, RunStatus.RANGE_LEFT),
        ({"step_limit": 1}, RunStatus.STEP_LIMIT),
        ({"time_limit": 1e-9}, RunStatus.TIME_LIMIT),
    ],
)
def test_a_run_that_does_not_complete_has_no_sensitivities(change, status):
    data = oscillator_config(*OSCILLATOR.values())
    data["initial"]["angular_velocity"] = [1.0, 3.0, 0.0]
    data["integration"] |= change
    with pytest.raises(UnfinishedRunError) as raised:
        sensitivities(data)
    assert raised.value.status is status
    assert " at t = " in str(raised.value)
