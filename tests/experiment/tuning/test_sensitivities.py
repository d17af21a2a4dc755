"""Protects the sensitivities of a run against finite differences."""

import numpy as np
import pytest
from support.outcomes import differences, quantities
from support.stored_differences import (
    CASES,
    METHODS,
    SMOOTH_CASES,
    SWITCHING_CASES,
    stored_differences,
)

from rbstab.experiment.tuning.sensitivities import sensitivities
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
    effects = sensitivities(data)
    np.testing.assert_allclose(
        quantities(data, effects, METHODS[name]), effects.values, rtol=0, atol=1e-9
    )
    settles = np.isfinite(effects.values)
    assert settles[1:].all()
    assert np.isfinite(effects.derivatives[:, settles]).all()
    expected = stored_differences(name, effects)
    # Each derivative is scaled by the size of its number, so that effects can be compared.
    sizes = np.array([[abs(entry.value) or 1.0] for entry in effects.entries])
    actual, expected = (effects.derivatives * sizes)[:, settles], (expected * sizes)[:, settles]
    allowed = ERROR * np.abs(expected) + NOISE * np.abs(expected).max(axis=0)
    off = np.argwhere(np.abs(actual - expected) > allowed)
    assert not [(effects.entries[i].key, effects.quantities[j].name) for i, j in off]


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_the_stored_differences_are_those_of_runs(name):
    effects = sensitivities(CASES[name])
    expected = stored_differences(name, effects)
    sizes = np.array([[abs(entry.value) or 1.0] for entry in effects.entries])
    allowed = NOISE * np.abs(expected * sizes).max(axis=0)
    off = np.abs(differences(CASES[name], effects, METHODS[name]) - expected) * sizes
    has_value = np.isfinite(effects.values)
    assert np.all((off <= allowed)[:, has_value])


def oscillator_config():
    """Return the config of a body that only translates: a damped oscillator."""
    return {
        "body": {"mass": 4.0, "inertia": [2.0, 1.5, 1.0], "contact_point": [0.15, 0.1, -0.42]},
        "gravity": [0, 0, -9.81],
        "controller": {
            "variant": "free",
            "K_t": [100, 100, 100],
            "L_t": [20, 20, 9],
            "K_r": [40, 40, 40],
            "L_r": [6, 6, 6],
        },
        "initial": {"position": [0, 0, 0.3], "velocity": [0, 0, 1.7]},
        "integration": {"duration": 5.0},
    }


def test_sensitivities_show_what_they_are():
    effects = sensitivities(oscillator_config())
    count = f"{len(effects.entries)} numbers, {len(effects.quantities)} quantities"
    assert repr(effects) == f"<rbstab.Sensitivities: {count}>"
    with pytest.raises(ValueError, match=r"no quantity 'settling' \(expected one of .*settling_t"):
        effects.column("settling")


def test_a_run_that_does_not_settle_has_no_settling_time():
    data = oscillator_config()
    data["integration"]["duration"] = 0.2
    effects = sensitivities(data)
    column = effects.column("settling_time")
    assert np.isnan(effects.values[column])
    assert np.isnan(effects.derivatives[:, column]).all()
    assert np.isfinite(np.delete(effects.derivatives, column, axis=1)).all()


def test_a_peak_at_an_end_of_the_run_stays_there():
    data = oscillator_config()
    data["initial"]["velocity"] = [0, 0, 0]
    data["gravity"] = [0, 0, 0]
    effects = sensitivities(data)
    row = effects.derivatives[[e.key for e in effects.entries].index("initial.position[2]")]
    assert effects.values[effects.column("peak_time[2]")] == 0.0
    assert row[effects.column("peak_time[2]")] == 0.0
    assert row[effects.column("peak_contact_displacement[2]")] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({"range_bound": 0.999}, RunStatus.RANGE_LEFT),
        ({"step_limit": 1}, RunStatus.STEP_LIMIT),
        ({"time_limit": 1e-9}, RunStatus.TIME_LIMIT),
    ],
)
def test_a_run_that_does_not_complete_has_no_sensitivities(change, status):
    data = oscillator_config()
    data["initial"]["angular_velocity"] = [1.0, 3.0, 0.0]
    data["integration"] |= change
    with pytest.raises(UnfinishedRunError) as raised:
        sensitivities(data)
    assert raised.value.status is status
    assert " at t = " in str(raised.value)
