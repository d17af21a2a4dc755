"""Sensitivities and tuning of the numbers of elements."""

from dataclasses import replace

import numpy as np
import pytest
from support.config_elements import STRUT, config_data
from support.problems import solve

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.config.numbers import replaced
from rbstab.experiment.tuning.gain_scaling import TuningError, gain_scalings
from rbstab.experiment.tuning.sensitivities import sensitivities

DATA = config_data(integration={"duration": 0.4, "samples": 21})

CHANGES = [
    "elements.strut.point[2]",
    "elements.strut.rest_length",
    "elements.tie.K_c[0][1]",
    "elements.upright.L[1]",
    "elements.range.outer_stiffness",
]


@pytest.fixture(scope="module")
def effects():
    return sensitivities(DATA)


def end_of_run(entry, shift):
    """Return the final state of a run with a number shifted; a matrix stays symmetric."""
    shifts = dict.fromkeys(entry.paths, entry.value + shift)
    problem = problem_of(replaced(load_config(DATA), shifts))
    trajectory = solve(
        "scipy", replace(problem, rtol=3e-14, atol=1e-15, times=problem.times[[0, -1]])
    )
    assert trajectory.status == "completed"
    return trajectory.states[-1]


@pytest.mark.parametrize("key", CHANGES)
def test_derivatives_are_those_of_differences_of_runs(effects, key):
    """The final Θ, Ω, X, V by finite differences of fourth order, by the other engine."""
    (row,) = [k for k, entry in enumerate(effects.entries) if entry.key == key]
    entry = effects.entries[row]
    names = ("orientation", "angular_velocity", "position", "velocity")
    columns = [effects.column(f"final.{name}[{axis}]") for name in names for axis in range(3)]
    step = 2e-3 * (abs(entry.value) or 1.0)
    ends = [end_of_run(entry, s * step) for s in (-2, -1, 1, 2)]
    differences = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * step)
    actual, scale = effects.derivatives[row][columns], np.abs(differences).max()
    assert scale > 0
    assert np.abs(actual - differences).max() < 1e-6 * scale


def keys_of(*keys):
    return [scaling.key for scaling in gain_scalings(load_config(DATA), keys)]


def test_gains_of_elements_can_be_tuned():
    keys = ["controller.L_r", "elements.strut.damping", "elements.tie.K_c", "elements.tie.L_c[1]"]
    keys += ["elements.strut.rest_length", "elements.upright.K", "elements.range.outer_stiffness"]
    assert keys_of(*keys) == keys


@pytest.mark.parametrize("key", ["strut.point[0]", "strut.kind", "other.damping", "strut"])
def test_places_and_what_is_no_gain_cannot_be_tuned(key):
    with pytest.raises(TuningError, match="is not a gain of this config") as caught:
        keys_of(f"elements.{key}")
    assert "elements.strut.damping" in str(caught.value)
    assert "point" not in str(caught.value).partition("expected")[2]


def test_a_gain_of_zero_cannot_be_scaled():
    elements = {"strut": STRUT | {"damping": 0.0}}
    with pytest.raises(TuningError, match=r"damping: is 0, so no factor changes it"):
        gain_scalings(load_config(config_data(elements)), ["elements.strut.damping"])
