"""A body that starts at rest is at rest from t = 0: in runs and in tuning."""

import math
from typing import Any

import numpy as np
import pytest
from support.leg import held, leg

from rbstab.experiment.simulate import simulate
from rbstab.experiment.summary import settling_time_of, summary_of
from rbstab.experiment.tuning.sensitivities import sensitivities
from rbstab.experiment.tuning.tune import tune

WEIGHT = 3.5 * 9.81
"""m g of the leg, N."""

Config = dict[str, Any]


def standing(stiffness=4e4, **initial):
    """Return a leg that stands on a tie under its weight; at rest it is lower by m g / k."""
    config = leg(initial={"position": [0, 0, -WEIGHT / (stiffness + 1e-6)]} | initial)
    config["controller"]["K_c"] = [4000, 4000, stiffness]
    return config | {"integration": {"duration": 2, "samples": 101}}


def on_elements(**initial):
    """Return a body with a tie and a spring of the attitude, of schema version 2."""
    tie = {"point": [0, 0, 0], "anchor": [0, 0, 0], "K_c": [100] * 3, "L_c": [5] * 3}
    return {
        "schema_version": 2,
        "body": {"mass": 1, "inertia": [0.01, 0.01, 0.01], "contact_point": [0, 0, 0]},
        "elements": {
            "tie": {"kind": "visco-elastic", **tie},
            "upright": {"kind": "attitude", "K": [1, 1.2, 1.5], "L": [0.1, 0.1, 0.1]},
        },
        "initial": initial,
        "integration": {"duration": 2, "samples": 101},
    }


def alone(**initial):
    """Return a body on which nothing acts."""
    return {
        "schema_version": 2,
        "body": {"mass": 1, "inertia": [3, 5, 7], "contact_point": [0, 0, 0]},
        "initial": initial,
        "integration": {"duration": 2, "samples": 21},
    }


AT_REST = {
    "held": held(),
    "on elements": on_elements(),
    "under its weight": standing(),
    "under its weight, stiff": standing(4e8),
    "under its weight, to round-off": standing(orientation=[0, 1e-12, 0]),
    "alone and turned": alone(orientation=[0.3, -0.2, 0.1]),
}


@pytest.mark.parametrize("engine", ["scipy", "heyoka"])
@pytest.mark.parametrize("name", AT_REST)
def test_a_start_at_rest_is_at_rest_from_the_start(name, engine):
    config = AT_REST[name]
    config = config | {"integration": config["integration"] | {"engine": engine}}
    result = simulate(config)
    assert settling_time_of(result) == 0.0
    assert summary_of(result).relative_residual < 1e-8
    assert result.attributes["verdict"] != "violated"


@pytest.mark.parametrize(
    ("config", "settles"),
    [
        # ½ 7 kg m² (1 rad/s)² stays.
        (alone(angular_velocity=[0, 0, 1]), False),
        (alone(angular_velocity=[0, 0, 1e-6]), False),
        (on_elements(orientation=[1e-5, 0, 0]), True),
        (standing(orientation=[0, 1e-5, 0]), True),
    ],
)
def test_a_body_that_moves_is_not_at_rest_from_the_start(config, settles):
    time = settling_time_of(simulate(config))
    assert math.isnan(time) != settles
    assert not time < 0.05


@pytest.mark.parametrize("objective", ["settling_time", "energy"])
def test_tuning_has_nothing_to_improve_at_rest(objective):
    tuned = tune(held(), objective, "controller.L_r")
    assert (tuned.given, tuned.value, tuned.failures) == (0.0, 0.0, 0)
    assert not tuned.better


def test_the_settling_time_of_a_body_at_rest_has_no_derivative():
    effects = sensitivities(held())
    place = effects.column("settling_time")
    assert effects.settles
    assert effects.values[place] == 0.0
    assert np.isnan(effects.derivatives[:, place]).all()
