"""A top without springs and dampers stands above ω = 2 √(m g l I1) / I3, and falls below."""

import numpy as np
import pytest
from support.pose import attitude

import rbstab

MASS, LENGTH, GRAVITY = 0.5, 0.06, 9.81
MOMENTS = np.array([0.0015, 0.0015, 0.0004])
ABOUT_PIN = MOMENTS + MASS * LENGTH**2 * np.array([1.0, 1.0, 0.0])
LEAST_SPIN = 2 * np.sqrt(MASS * GRAVITY * LENGTH * ABOUT_PIN[0]) / MOMENTS[2]


def top(spin, **controller):
    return {
        "body": {"mass": MASS, "inertia": MOMENTS.tolist(), "contact_point": [0, 0, -LENGTH]},
        "gravity": [0, 0, -GRAVITY],
        "controller": {"variant": "permanent", **controller},
        "initial": {"orientation": [0.001, 0, 0], "angular_velocity": [0, 0, float(spin)]},
        "integration": {"duration": 10, "samples": 401},
    }


def test_the_least_spin_is_that_of_the_textbook():
    assert pytest.approx(155.820, abs=5e-4) == LEAST_SPIN


@pytest.mark.heavy
@pytest.mark.parametrize("engine", ["scipy", "heyoka"])
@pytest.mark.parametrize(("share", "stands"), [(0.97, False), (1.03, True)])
def test_a_top_stands_above_the_least_spin(engine, share, stands):
    config = top(share * LEAST_SPIN)
    config["integration"]["engine"] = engine
    result = rbstab.simulate(config)
    A = np.array([attitude(Theta) for Theta in result["orientation"]])
    Omega = result["angular_velocity"]
    tilt = np.arccos(A[:, 2, 2].clip(-1, 1))
    assert result.status == "completed"
    # Small motions tilt by 0.001 / √(1 - 1/share²) = 0.0042 rad.
    assert tilt.max() < 0.0045 if stands else tilt.max() > 0.2
    momentum = ABOUT_PIN * Omega
    kinetic = 0.5 * (momentum * Omega).sum(axis=1)
    constants = {
        "energy": kinetic + MASS * GRAVITY * LENGTH * A[:, 2, 2],
        "vertical momentum": np.einsum("tj,tj->t", A[:, 2], momentum),
        "axial momentum": momentum[:, 2],
    }
    for name, values in constants.items():
        np.testing.assert_allclose(values, values[0], rtol=1e-10, err_msg=name)
