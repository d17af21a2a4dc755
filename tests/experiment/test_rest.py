"""Protects the rest state from which v is counted, and the anchor at the loaded rest position."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation
from support.paper_runs import paper_config, paper_matrix, reference_case
from support.problems import ENGINES
from support.systems import VARIANTS

import rbstab
from rbstab.experiment.proof import prove

WEIGHT = np.array([0.0, 0.0, -410.0])
TIED = ("permanent", "visco-elastic", "embedded")
# The rest position of the centre under its weight: 410 N over 3280 N/m.
LOADED = np.array([0.0, 0.0, -0.125])

each_tied = pytest.mark.parametrize("variant", TIED)


def least_stored_energy(variant):
    """Return the minimum of the stored energy and its place, by SciPy's rotations and minimizer."""
    R = np.array(reference_case(variant, with_gravity=True)["params"]["R"])
    K_t, K_r = paper_matrix(variant, "Kt"), paper_matrix(variant, "Kr")

    def stored(q):
        arm = Rotation.from_euler("XYZ", q[:3]).as_matrix() @ R - R
        X = -arm if variant == "permanent" else q[3:6]
        energy = q[:3] @ K_r @ q[:3] / 2 + X @ K_t @ X / 2 - WEIGHT @ X
        if variant == "visco-elastic":
            energy += (X + arm) @ paper_matrix(variant, "Kc") @ (X + arm) / 2
        if variant == "embedded":
            D, E = q[6:9], X + arm
            energy += (E - D) @ paper_matrix(variant, "Kc") @ (E - D) / 2
            energy += D @ paper_matrix(variant, "Kd") @ D / 2
        return energy

    size = {"permanent": 3, "embedded": 9}.get(variant, 6)
    minimum = minimize(stored, np.zeros(size), method="BFGS", options={"gtol": 1e-6})
    return minimum.fun, minimum.x


@pytest.mark.parametrize("variant", VARIANTS)
def test_energy_at_rest_is_the_least_that_can_be_stored(variant):
    result = rbstab.simulate(paper_config(variant, with_gravity=True, duration=0.01, samples=2))
    expected, _ = least_stored_energy(variant)
    assert result["energy_at_rest"] == pytest.approx(expected, rel=1e-8)


# Published values for these parameters, to the given digits.
@pytest.mark.parametrize(
    ("variant", "expected", "error"),
    [
        ("permanent", (0.03917, -0.05825, 0.00018), 5e-6),
        ("visco-elastic", (0.0347, -0.0517, 0.00012), 5e-5),
    ],
)
def test_load_turns_a_body_that_is_anchored_at_the_origin(variant, expected, error):
    config = paper_config(variant, with_gravity=True, duration=14.0, samples=2, engine="heyoka")
    end = rbstab.simulate(config)["orientation"][-1]
    np.testing.assert_allclose(end, expected, rtol=0, atol=error)


@each_tied
def test_anchor_at_the_equilibrium_makes_level_the_rest_state(variant):
    long: dict[str, Any] = {"duration": 14.0, "samples": 15, "engine": "heyoka"}
    anchored = {"anchor": "equilibrium"}
    result = rbstab.simulate(paper_config(variant, with_gravity=True, controller=anchored, **long))
    assert result.status == "completed"
    np.testing.assert_allclose(result["orientation"][-1], 0.0, rtol=0, atol=1e-8)
    np.testing.assert_allclose(result["position"][-1], LOADED, rtol=0, atol=1e-8)
    np.testing.assert_allclose(result["contact_displacement"][-1], 0.0, rtol=0, atol=1e-8)
    assert abs(result["lyapunov"][-1]) < 1e-9
    # E is relative to that anchor at every sample.
    R = np.array([0.15, 0.1, -0.42])
    A = Rotation.from_euler("XYZ", result["orientation"]).as_matrix()
    np.testing.assert_allclose(
        result["contact_displacement"], result["position"] + A @ R - R - LOADED, rtol=0, atol=1e-13
    )


SEVERAL: dict[str, Any] = {
    # A heavy body on soft springs, held below: it can hang to either side.
    "body": {"mass": 41, "inertia": [10, 9, 2], "contact_point": [0.15, 0.10, -0.42]},
    "gravity": [0, 0, -4000],
    "controller": {
        "variant": "permanent",
        "K_r": [4, 4, 3.2],
        "L_r": [60, 60, 42],
        "K_t": [4100, 4100, 3280],
        "L_t": [200, 200, 140],
    },
    "integration": {"duration": 5.0, "samples": 51},
}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("side", [1, -1])
def test_v_counts_from_the_rest_state_that_a_motion_approaches(engine, side):
    """It did count from one that the motion leaves, and was negative at the end: `violated`."""
    start = {"orientation": [side * 2.5, 0.2, side * 0.8]}
    changes = {"initial": start, "integration": {**SEVERAL["integration"], "engine": engine}}
    config = rbstab.load_config(SEVERAL | changes)
    result = rbstab.simulate(config)
    assert np.sign(result["rest_orientation"][0]) == side
    np.testing.assert_allclose(result["rest_orientation"], result["orientation"][-1], atol=0.7)
    assert result["lyapunov"].min() >= 0
    assert result.attributes["verdict"] == "consistent"
    # From the other side the body is still 0.3 rad away at the end.
    name = "that the motion approaches" if side > 0 else "below the end of the motion"
    assert str(result.attributes["lyapunov_zero"]).startswith(f"the rest state {name}")
    # The state is one of those that are proved, and is named by its number.
    proof = prove(config)
    number = 1 + int(
        np.argmin([np.abs(s.orientation - result["rest_orientation"]).max() for s in proof.states])
    )
    assert proof.states[number - 1].energy == pytest.approx(float(result["energy_at_rest"]))
    named = rbstab.simulate(config, proof=proof).attributes["lyapunov_zero"]
    assert f"number {number} of the {len(proof.states)} in the range of eq. 5, the lowest" in str(
        named
    )
