"""Protects tuning: it finds known optima, never makes a config worse, and refuses bad input."""

import math

import numpy as np
import pytest
from support.paper_runs import paper_config

from rbstab.config.load import load_config
from rbstab.experiment.tuning.gain_scaling import TuningError, gain_scalings
from rbstab.experiment.tuning.objective import OBJECTIVES
from rbstab.experiment.tuning.search import Search
from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError
from rbstab.experiment.tuning.tune import tune

MASS, STIFFNESS, OFFSET = 4.0, 100.0, 0.3


def oscillator(damping, duration=6.0):
    """Return the config of a body that only translates along one axis, released from an offset."""
    return {
        "body": {"mass": MASS, "inertia": [2.0, 1.5, 1.0], "contact_point": [0.15, 0.1, -0.42]},
        "controller": {
            "variant": "free",
            "K_t": [100, 100, STIFFNESS],
            "L_t": [20, 20, damping],
            "K_r": [40, 40, 40],
            "L_r": [6, 6, 6],
        },
        "initial": {"position": [0, 0, OFFSET]},
        "integration": {"duration": duration},
    }


def test_the_least_energy_over_time_is_at_the_textbook_damping():
    # From rest, ∫v dt = k x²/2 (m/l + l/(2k)): least at l = √(2mk), a damping ratio of 1/√2.
    tuned = tune(oscillator(10.0), "energy", ["controller.L_t[2]"])
    best = math.sqrt(2 * MASS * STIFFNESS)
    least = 0.5 * STIFFNESS * OFFSET**2 * (MASS / best + best / (2 * STIFFNESS))
    assert tuned.value == pytest.approx(least, rel=1e-9)
    assert 10.0 * tuned.factors[0] == pytest.approx(best, rel=1e-5)


def test_an_optimum_at_a_bound_is_on_it():
    tuned = tune(oscillator(2.0), "energy", ["controller.L_t[2]"], (0.5, 10.0))
    # exp(log 10) would be one digit above the bound.
    assert tuned.factors == (10.0,)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_gradients_are_differences_of_the_objective(objective):
    config = load_config(paper_config("visco-elastic", with_gravity=True))
    scalings = gain_scalings(config, ["controller.L_r", "controller.K_c", "controller.L_t[1]"])
    search = Search(config, OBJECTIVES[objective], scalings, (0.1, 10.0))
    x, h = np.array([0.2, -0.1, 0.3]), 1e-4
    value, gradient = search.evaluate(x, gradient=True)
    expected = [(search.value(x + h * e) - search.value(x - h * e)) / (2 * h) for e in np.eye(3)]
    assert value == search.value(x)
    np.testing.assert_allclose(gradient, expected, rtol=1e-5, atol=1e-7 * value)


def test_nothing_better_leaves_the_config_as_it_is():
    config = load_config(oscillator(30.0))
    tuned = tune(config, "settling_time", ["controller.L_t[2]"], (1.0, 1.0))
    assert not tuned.better
    assert tuned.config is config
    assert tuned.factors == (1.0,)
    assert tuned.value == tuned.given < 6.0


def test_runs_that_fail_count_as_worst():
    # With little damping the body turns too far.
    data = oscillator(20.0, 1.0)
    data["initial"] = {"angular_velocity": [0.0, 3.0, 0.0]}
    data["integration"]["range_bound"] = 0.9
    tuned = tune(data, "energy", ["controller.L_r"], (0.02, 4.0))
    assert tuned.failures > 0
    assert math.isfinite(tuned.value)
    assert tuned.value < tuned.given


FULL = {"K_t": [[4100, 600, 0], [600, 4100, 0], [0, 0, 3280]]}


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (["controller.K_c"], "controller.K_c: is not a gain of this config (expected one of contr"),
        (["body.mass"], "body.mass: is not a gain"),
        (["controller"], "controller: is not a gain"),
        (["L_r"], "L_r: is not a gain"),
        ([""], ": is not a gain"),
        (["controller.L_r[3]"], "controller.L_r[3]: does not exist"),
        (["controller.L_r[0][0]"], "controller.L_r[0][0]: does not exist"),
        (["controller.K_t[0][0]"], "is one entry of a full matrix"),
        (["controller.K_t[1]"], "is one entry of a full matrix"),
        (["controller.L_r", "controller.L_r[1]"], "controller.L_r[1] is scaled by contr"),
        ([], "no gain to tune"),
    ],
)
def test_what_cannot_be_scaled_is_refused(keys, message):
    config = load_config(paper_config("permanent", controller=FULL))
    with pytest.raises(TuningError) as raised:
        gain_scalings(config, keys)
    assert message in str(raised.value)


def test_a_held_contact_point_has_no_peak_to_lower():
    with pytest.raises(UnsuitedConfigError, match="does not move"):
        tune(paper_config("permanent"), "peak_displacement", ["controller.L_r"])


@pytest.mark.parametrize("bounds", [(2.0, 3.0), (0.0, 2.0), (0.1, 0.9), (0.1, math.inf)])
def test_bounds_hold_the_given_config(bounds):
    with pytest.raises(ValueError, match="bounds"):
        tune(oscillator(20.0), "energy", ["controller.L_t"], bounds)


def test_an_unknown_objective_is_refused():
    with pytest.raises(
        ValueError, match="expected one of settling_time, peak_displacement, energy"
    ):
        tune(oscillator(20.0), "speed", ["controller.L_t"])
