"""Protects runs with a sliding connector: energy balance, switches, sticking, stored quantities."""

from typing import Any

import numpy as np
import pytest

import rbstab

CONFIG: dict[str, Any] = {
    "body": {"mass": 41, "inertia": [10, 8, 0.4], "contact_point": [0.15, 0.1, -0.42]},
    "controller": {
        "variant": "sliding",
        "K_s": [20000, 20000, 20000],
        "surface": {"slope": 20},
        "K_t": [4100, 4100, 3280],
        "L_t": [200, 200, 140],
        "K_r": [400, 400, 320],
        "L_r": [60, 60, 42],
    },
    "initial": {"angular_velocity": [16, 32, -16]},
    "integration": {"duration": 0.3, "samples": 31, "engine": "heyoka"},
}

LAWS: dict[str, dict[str, Any]] = {
    "position": {"surface": "position"},
    "position, sticking": {"surface": "position", "stick_energy": 300.0},
    "position, layer": {"surface": "position", "law": {"boundary_layer": 1e-3}},
    "position, implicit": {"surface": "position", "law": {"implicit": 1e-3}},
    "slope": {"surface": {"slope": 20}},
    "slope, layer": {"surface": {"slope": 20}, "law": {"boundary_layer": 1e-2}},
}


def run(gravity=(0, 0, 0), engine="heyoka", **controller):
    config = {
        **CONFIG,
        "gravity": gravity,
        "controller": {**CONFIG["controller"], **controller},
        "integration": {**CONFIG["integration"], "engine": engine},
    }
    return rbstab.simulate(config)


@pytest.mark.parametrize("gravity", [(0, 0, 0), (0, 0, -10)])
@pytest.mark.parametrize("law", LAWS)
def test_every_audit_closes(law, gravity):
    result = run(gravity, **LAWS[law])
    assert result.status == "completed"
    residual = np.abs(result["energy_residual"]).max()
    # Implicit steps are of first order, also where the motion is smooth.
    assert residual < (1e-2 if "implicit" in law else 1e-9) * result["lyapunov"][0]
    assert result["lyapunov"][-1] < result["lyapunov"][0]


def test_a_stored_potential_on_the_position():
    """The potential is Σ K_s |E|, J."""
    result = run(**LAWS["position"])
    stored = result["energy"][:, result["part"].tolist().index("connector")]
    expected = 20000 * np.abs(result["contact_displacement"]).sum(axis=1)
    assert stored == pytest.approx(expected, rel=1e-12)


def test_what_sticking_discards_is_told():
    result = run(**LAWS["position, sticking"])
    assert set(result["transition_kind"].tolist()) == {"stick"}
    assert 0 < result["discarded_energy"][-1] <= 300.0
    assert (result["mode"][-1] == 0).all()


def test_implicit_steps_say_that_they_damp():
    result = run(**LAWS["position, implicit"])
    assert "damp the motion numerically" in result.attributes["warnings"]
    assert result["discarded_energy"][-1] > 100
    assert "damp" not in run(**LAWS["position"]).attributes["warnings"]
