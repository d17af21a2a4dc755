"""Protects the warnings of a run: unusual facts that are not errors."""

import numpy as np
import pytest
from support.paper_runs import paper_config, paper_run
from support.problems import ENGINES
from support.systems import VARIANTS

import rbstab

REAL_BODY = {"mass": 41.0, "inertia": [10.0, 8.0, 4.0], "contact_point": [0.15, 0.1, -0.42]}


def warnings(result):
    """Return the warnings of a result, one by one."""
    text = result.attributes["warnings"]
    return text.split("\n") if text else []


def turning(Omega, engine="scipy", **integration):
    """Run a real body that turns almost freely about one of its principal axes."""
    weak = {"K_r": [1e-9] * 3, "L_r": [1e-9] * 3}
    config = paper_config(
        "free",
        controller=weak,
        initial={"angular_velocity": list(Omega)},
        engine=engine,
        **({"samples": 201, "rtol": 1e-9} | integration),
    )
    return rbstab.simulate(config | {"body": REAL_BODY})


@pytest.mark.parametrize("variant", VARIANTS)
def test_inertia_of_the_paper_is_of_no_real_body(variant):
    (warning,) = warnings(paper_run(variant, True, "scipy"))
    assert warning == (
        "body.inertia: no real body has the principal moments 10, 8, 0.4 kg m²: "
        "10 > 8 + 0.4 breaks the triangle inequality"
    )


def test_real_body_that_stays_in_range_is_nothing_odd():
    assert warnings(turning((0.5, 0.0, 0.0))) == []


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("axis", "name"), [(0, "θ1"), (2, "θ3")])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_angle_beyond_pi_is_told_with_its_time(engine, axis, name, sign):
    result = turning(sign * 4.0 * np.eye(3)[axis], engine)
    assert result.status == "completed"
    # At 4 rad/s the angle passes π at 0.7854 s; samples are 10 ms apart.
    winding, outside = warnings(result)
    assert winding.startswith(f"controller.K_r: the spin winds {name} up")
    assert outside == f"{name} is outside [-π, π], the range of eq. 5, from t = 0.79 s"


def test_angles_that_no_element_reads_need_no_warning():
    spin = {"initial": {"angular_velocity": [0, 0, 4]}, "integration": {"duration": 1}}
    result = rbstab.simulate({"schema_version": 2, "body": REAL_BODY, **spin})
    assert result["orientation"][-1, 2] == pytest.approx(4.0)
    assert warnings(result) == []


def test_angle_that_comes_back_is_told_from_its_first_time():
    # θ1 = 4 sin(ω t) with ω² = K/J1 leaves the range and returns; at t = 1 s it is inside.
    frequency = 3.0
    config = paper_config(
        "free",
        controller={"K_r": [10.0 * frequency**2] * 3, "L_r": [1e-9] * 3},
        initial={"angular_velocity": [4.0 * frequency, 0.0, 0.0]},
        duration=1.0,
        samples=101,
    )
    result = rbstab.simulate(config | {"body": REAL_BODY})
    assert abs(result["orientation"][-1, 0]) < np.pi
    leaves = np.ceil(100 * np.arcsin(np.pi / 4.0) / frequency) / 100
    assert warnings(result) == [f"θ1 is outside [-π, π], the range of eq. 5, from t = {leaves:g} s"]


def sliding(surface, duration):
    controller = {"variant": "sliding", "K_s": [20000.0] * 3, "surface": surface}
    return rbstab.simulate(
        paper_config("free", engine="heyoka", controller=controller, duration=duration, samples=41)
    )


@pytest.mark.slow
def test_a_chaotic_motion_is_told_with_the_time():
    result = sliding("position", 0.4)
    trusted = float(result["trusted_until"])
    assert 0.1 < trusted < 0.4
    assert warnings(result)[1:] == [
        f"the motion is not reproducible after t = {trusted:.6g} s (trusted_until): a start that "
        "differs in the last digit leads to another motion"
    ]


def test_a_run_that_ends_early_is_not_chaotic_for_that():
    """The last sample of such a run is at no time that other runs share."""
    weak = {"K_r": [1e-3] * 3, "L_r": [1e-3] * 3}
    controller = {"variant": "sliding", "K_s": [1.0] * 3, "surface": "position", **weak}
    start = {"angular_velocity": [0.0, 40.0, 0.0]}
    config = paper_config(
        "free", engine="heyoka", controller=controller, initial=start, samples=201
    )
    result = rbstab.simulate(config)
    assert result.status == "range left"
    assert float(result["trusted_until"]) == result["time"][-2] < result["time"][-1]
    assert not [warning for warning in warnings(result) if "not reproducible" in warning]
