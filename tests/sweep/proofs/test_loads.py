"""Protects how large the disturbances of members may become: against samples of their loads."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.gusts import GUST, plan_of
from support.inputs import SIGNALS

from rbstab.experiment.disturbed.prove_bound import stated_in
from rbstab.sweep.proofs.loads import disturbances

POINT = [0.0, 0.0, 0.4]
PUSH = GUST | {"quantity": "force", "point": POINT, "direction": [1.0, 0.0, 0.0], "amplitude": 3.0}
PULSE = {"kind": "pulse", "start": 1.0, "duration": 1.0}


def found(vary, *gusts, **sections):
    """Return the disturbances of the members of a plan."""
    plan = plan_of(vary, *gusts, sections=sections)
    stated = stated_in(plan.base_of("permanent"))
    assert stated is not None
    return disturbances(plan, stated)


def of(*gusts, **sections):
    """Return whether all loads are below the bounds, and whether another one acts."""
    largest, below, other = found({"body.mass": {"values": [12.0]}}, *gusts, **sections)
    return {kind: size.item() for kind, size in largest.items()}, below.item(), other.item()


@pytest.mark.parametrize("seed", range(5))
def test_no_course_of_the_loads_is_larger(seed):
    """Sines of other phases, about random directions, some of which turn with the body."""
    rng = np.random.default_rng(seed)
    quantities = rng.choice(["couple", "body_couple"], 3)
    gusts: list[dict[str, Any]] = [
        GUST | {"quantity": q, "direction": rng.normal(size=3).tolist(), "amplitude": a}
        for q, a in zip(quantities, rng.uniform(-20, 20, 3).tolist(), strict=True)
    ]
    largest, _, other = of(*gusts)
    turns = Rotation.random(4000, random_state=seed)
    total = np.zeros((4000, 3))
    for gust in gusts:
        direction = np.array(gust["direction"]) / np.linalg.norm(gust["direction"])
        along = turns.apply(direction) if gust["quantity"] == "body_couple" else direction
        total += gust["amplitude"] * rng.uniform(-1, 1, (4000, 1)).round() * along
    sizes = np.linalg.norm(total, axis=1)
    assert sizes.max() <= largest["couple"] * (1 + 1e-12)
    assert largest["couple"] <= sum(abs(gust["amplitude"]) for gust in gusts) * (1 + 1e-12)
    assert not other


def test_gusts_at_right_angles_add_as_the_sides_of_a_triangle():
    gusts = (
        GUST | {"direction": [0.6, 0.8, 0.0], "amplitude": 16.0},
        GUST | {"direction": [0.8, -0.6, 0.0], "amplitude": -11.9, "signal": PULSE},
    )
    largest, below, _ = of(*gusts)
    assert largest["couple"] == pytest.approx(np.hypot(16.0, 11.9), rel=1e-12)
    assert below
    # In two frames the angle between them may be any.
    turning = gusts[1] | {"quantity": "body_couple"}
    largest, below, _ = of(gusts[0], turning)
    assert largest["couple"] == pytest.approx(27.9, rel=1e-12)
    assert not below


def test_up_to_the_bound_and_not_beyond_it():
    sizes = [20.0, -20.0, np.nextafter(20.0, 30.0), 0.0]
    _, below, other = found({"elements.gust0.amplitude": {"values": sizes}})
    assert below.tolist() == [True, True, False, True]
    assert not other.any()
    table = {"kind": "table", "times": [0.0, 1.0], "values": [0.0, -2.0]}
    for amplitude, expected in ((9.99, True), (10.01, False)):
        largest, below, _ = of(GUST | {"amplitude": amplitude, "signal": table})
        assert largest["couple"] == pytest.approx(2 * amplitude)
        assert below is expected


@pytest.mark.parametrize("kind", SIGNALS)
def test_each_signal_has_its_largest_value(kind):
    largest, below, _ = of(GUST | {"signal": SIGNALS[kind]})
    if kind == "noise":  # it has none
        assert largest["couple"] == np.inf or np.isnan(largest["couple"])
    else:
        assert largest["couple"] == pytest.approx(20.0)
    assert below is (kind != "noise")


def test_a_load_that_is_not_bounded_is_another_one():
    forces = {"bound": {"force": 5.0, "point": POINT, "tilt": 0.5}}
    assert of(PUSH)[1:] == (False, True)
    assert of(GUST, **forces)[1:] == (False, True)
    assert of(PUSH, **forces)[1:] == (True, False)
    assert of(PUSH | {"point": [0.0, 0.0, 0.41]}, **forces)[1:] == (False, True)
    both = {"bound": {"couple": 25.0, "force": 5.0, "point": POINT, "tilt": 0.5}}
    assert of(PUSH, GUST, **both) == ({"couple": 20.0, "force": 3.0}, True, False)
    # Without any amplitude nothing acts; a force that never changes is like a weight.
    assert of(PUSH | {"amplitude": 0.0}, GUST)[1:] == (True, False)
    assert of(PUSH | {"signal": {"kind": "constant"}}, GUST)[1:] == (True, False)


def test_directions_may_vary():
    vary = {
        "zip": {
            "elements.gust0.direction[0]": {"values": [0.0, 1.0, 1.0]},
            "elements.gust1.amplitude": {"values": [8.0, 8.0, 6.0]},
        }
    }
    gusts = GUST | {"amplitude": 10.0}, GUST | {"direction": [1.0, 0.0, 0.0]}
    largest, below, _ = found({"pair": vary}, *gusts, bound={"couple": 16.5, "tilt": 0.5})
    s = np.sqrt(0.5)
    expected = [np.hypot(10, 8), np.hypot(10 * s + 8, 10 * s), np.hypot(10 * s + 6, 10 * s)]
    assert largest["couple"] == pytest.approx(expected)
    assert below.tolist() == [True, False, True]
