"""Motions with elements of the config: v never grows, both engines agree, and closed solutions."""

import numpy as np
import pytest
from support.config_elements import CONTROLLER, config_data, random_elements
from support.elements import random_spd
from support.problems import ENGINES

import rbstab
from rbstab.config.load import load_config


def random_data(seed, count, **integration):
    """Return a config of a random physical body with some random elements, thrown."""
    rng = np.random.default_rng(seed)
    # J = tr(S) I - S of a positive definite S is the inertia of some body.
    S = random_spd(rng, 2.0)
    inertia = np.trace(S) * np.eye(3) - S
    return config_data(
        random_elements(rng, count),
        CONTROLLER if seed % 2 else None,
        body={
            "mass": float(rng.uniform(5, 50)),
            "inertia": ((inertia + inertia.T) / 2).tolist(),
            "contact_point": rng.normal(size=3).tolist(),
        },
        gravity=rng.normal(size=3).tolist(),
        initial={
            "orientation": rng.uniform(-0.5, 0.5, 3).tolist(),
            "angular_velocity": rng.uniform(-1, 1, 3).tolist(),
            "velocity": rng.uniform(-0.5, 0.5, 3).tolist(),
        },
        integration={"duration": 0.5, "samples": 11, **integration},
    )


@pytest.mark.parametrize("count", [*range(1, 7), 20])
@pytest.mark.parametrize("coordinates", ["Z", "W"])
def test_v_never_grows_and_its_audit_is_clean(count, coordinates):
    result = rbstab.simulate(random_data(count, count, coordinates=coordinates))
    assert result.attributes["status"] == "completed"
    v, rate = result["lyapunov"], result["lyapunov_rate"]
    assert (rate <= 0).all()
    np.testing.assert_allclose(rate, -result["dissipation"].sum(axis=1), atol=1e-12 * v[0])
    assert (result["dissipation"] >= 0).all()
    assert np.abs(v - v[0] - result["lyapunov_change"]).max() < 1e-10 * v[0]
    assert result.attributes["verdict"] == "consistent"
    assert result["element_force"].shape == (11, count, 3)


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 4])
def test_engines_agree(count):
    by_scipy, by_heyoka = (
        rbstab.simulate(random_data(count, count, engine=engine)) for engine in ENGINES
    )
    for name in ("orientation", "angular_velocity", "position", "velocity", "element_couple"):
        scale = max(np.abs(by_scipy[name]).max(), 1.0)
        assert np.abs(by_scipy[name] - by_heyoka[name]).max() < 1e-9 * scale, name


def test_guard_keeps_a_body_inside_the_range():
    """Without it, the same body leaves the range of eq. 5, or in quaternions turns on."""
    fast = {
        "controller": None,
        "gravity": [0.0, 0.0, 0.0],
        "initial": {"orientation": [0.0, 0.0, 0.0], "angular_velocity": [0.0, 6.0, 0.0]},
        "integration": {"duration": 2.0, "samples": 21},
    }
    free = rbstab.simulate(load_config(config_data({}, **fast), ["integration.coordinates=Z"]))
    assert free.attributes["status"] == "range left"
    turned = rbstab.simulate(config_data({}, **fast))
    assert turned.attributes["status"] == "completed"
    # The body turns about its second axis at 6 rad/s: A33 = cos θ1 cos θ2 = cos 6t.
    assert np.abs(turned.rotation[:, 2, 2] - np.cos(6.0 * turned["time"])).max() < 1e-9
    guard = {"kind": "guard", "method": "barrier", "stiffness": 10.0}
    kept = rbstab.simulate(config_data({"range": guard}, **fast))
    assert kept.attributes["status"] == "completed"
    # ½ · 8 · 36 J = ½ · 10 tan² θ2 at the turning point.
    top = np.arctan(np.sqrt(8.0 * 36.0 / 10.0))
    assert 0.9 * top < np.abs(kept["orientation"][:, 1]).max() <= top * (1 + 1e-9)
