"""Protects the numbers of the paper's three cases, as other programs computed them."""

from typing import Any

import numpy as np
import pytest
from support.paper_runs import paper_config, paper_run
from support.problems import ENGINES

import rbstab

each_engine = pytest.mark.parametrize("engine", ENGINES)


def finely_sampled(variant, **controller):
    """Run the first half second, which holds all peaks, with samples close enough for them."""
    sampling: dict[str, Any] = {"duration": 0.5, "samples": 2001, "engine": "heyoka"}
    result = rbstab.simulate(paper_config(variant, controller=controller, **sampling))
    assert result.status == "completed"
    return result


@each_engine
@pytest.mark.parametrize(
    ("variant", "Theta", "Omega"),
    [
        ("permanent", (0.0046, -0.0005, -0.0020), (-0.0786, 0.0357, 0.0053)),
        ("visco-elastic", (0.0030, -0.0004, -0.0012), (-0.0302, -0.0113, 0.0026)),
    ],
    ids=["case 1", "case 2"],
)
def test_final_states_of_the_cases(variant, Theta, Omega, engine):
    result = paper_run(variant, False, engine)
    assert result["time"][-1] == 2.0
    np.testing.assert_array_equal(np.round(result["orientation"][-1], 4), Theta)
    np.testing.assert_array_equal(np.round(result["angular_velocity"][-1], 4), Omega)


@pytest.mark.parametrize(
    ("variant", "controller", "centimetres"),
    [
        ("visco-elastic", {}, (-21.6, 11.3, 13.4)),
        ("embedded", {}, (-21.9, 11.7, 14.5)),
        ("visco-elastic", {"L_c": [6000.0, 6000.0, 4200.0]}, (-4.3, 2.0, 2.8)),
    ],
    ids=["case 2", "case 3", "case 2 with ten times the damping"],
)
def test_excursions_of_the_contact_point(variant, controller, centimetres):
    E = finely_sampled(variant, **controller)["contact_displacement"]
    peaks = E[np.abs(E).argmax(axis=0), range(3)]
    # Half of the last digit, plus a margin for numbers that were rounded twice.
    np.testing.assert_allclose(100 * peaks, centimetres, rtol=0, atol=0.055)


def test_angles_of_case_1_stay_inside_the_range():
    result = finely_sampled("permanent")
    peaks = np.abs(result["orientation"]).max(axis=0)
    assert round(peaks[1], 3) == 1.247
    assert round(peaks[0], 2) == 2.61
    assert "outside" not in result.attributes["warnings"]


def test_largest_force_that_holds_the_point():
    # With the damping of cases 2 and 3; the expected number is truncated to whole newtons.
    force = finely_sampled("permanent", L_t=[200.0, 200.0, 140.0])["contact_force"]
    assert np.abs(force).max() == pytest.approx(16_041, abs=1)
