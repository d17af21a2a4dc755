"""A body with k times the mass and k times the gains has the same motion, since forces scale."""

import numpy as np
import pytest

import rbstab

GAINS = {
    "K_t": [4100, 4100, 3280],
    "L_t": [200, 200, 140],
    "K_r": [400, 400, 320],
    "L_r": [60, 60, 42],
    "K_c": [12300, 12300, 9840],
    "L_c": [600, 600, 420],
}


def run(scale, engine):
    body = {
        "mass": 41 * scale,
        "inertia": [10 * scale, 8 * scale, 0.4 * scale],
        "contact_point": [0.15, 0.1, -0.42],
    }
    gains = {name: [scale * gain for gain in diagonal] for name, diagonal in GAINS.items()}
    return rbstab.simulate(
        {
            "body": body,
            "controller": {"variant": "visco-elastic", **gains},
            "initial": {"angular_velocity": [16, 32, -16]},
            "integration": {"duration": 2.0, "engine": engine},
        }
    )


@pytest.fixture(scope="module")
def light():
    return run(1.0, "scipy")


@pytest.mark.parametrize("engine", ["scipy", "heyoka"])
@pytest.mark.parametrize("scale", [1e-4, 1e4, 1e6])
def test_the_motion_does_not_depend_on_the_scale(light, scale, engine):
    """Integrated energies grow with the scale; the errors of the motion do not."""
    heavy = run(scale, engine)
    for name in ("orientation", "angular_velocity", "position", "contact_displacement"):
        assert np.abs(heavy[name] - light[name]).max() < 1e-9, name
    assert heavy["lyapunov_change"] == pytest.approx(scale * light["lyapunov_change"], rel=1e-9)
    assert heavy["contact_work"][-1] == pytest.approx(scale * light["contact_work"][-1], rel=1e-9)
