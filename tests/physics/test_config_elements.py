"""Motions with elements of the config: v never grows, both engines agree, and closed solutions."""

import numpy as np
import pytest
from support.config_elements import CONTROLLER, config_data, random_elements
from support.elements import random_spd
from support.problems import ENGINES, problem, solve

import rbstab
from rbstab.elements.gravity import Gravity
from rbstab.elements.spring import Spring
from rbstab.mechanics.body import Body
from rbstab.systems.coordinates import CentreCoordinates
from rbstab.systems.system import System

MASS, STIFFNESS, FALL = 400.0, 2500.0, 9.81


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


@pytest.mark.parametrize("point", [[0.0, 0.0, 0.0], [0.0, 0.0, 0.7]], ids=["centre", "above it"])
@pytest.mark.parametrize("engine", ENGINES)
def test_heavy_body_on_one_spring_is_an_oscillator(engine, point):
    """It hangs at ℓ₀ + mg/k and swings at √(k/m), damped by c/2m."""
    damping, rest_length, swing = 120.0, 1.0, 0.05
    spring = Spring(
        name="a",
        point=np.array(point),
        anchor=np.array([0.0, 0.0, 5.0]),
        stiffness=STIFFNESS,
        rest_length=rest_length,
        damping=damping,
    )
    body = Body(MASS, np.diag([10.0, 8.0, 9.0]), np.array([0.1, 0.2, 0.3]))
    weight = Gravity(np.array([0.0, 0.0, -MASS * FALL]))
    system = System(body, (weight, spring), CentreCoordinates(), np.zeros(3))
    hanging = 5.0 - point[2] - rest_length - MASS * FALL / STIFFNESS
    start = np.zeros(12)
    start[8] = hanging - swing
    times = np.linspace(0.0, 4.0, 41)
    trajectory = solve(engine, problem(system, start, times))
    assert trajectory.status == "completed"
    decay = damping / (2 * MASS)
    pace = np.sqrt(STIFFNESS / MASS - decay**2)
    wave = np.cos(pace * times) + decay / pace * np.sin(pace * times)
    expected = hanging - swing * np.exp(-decay * times) * wave
    np.testing.assert_allclose(trajectory.states[:, 8], expected, rtol=0, atol=1e-10)
    np.testing.assert_allclose(np.delete(trajectory.states, [8, 11], axis=1), 0, atol=1e-12)


def test_attitude_spring_lets_a_body_swing_about_an_axis():
    """J φ̈ = -k sin φ about a principal axis: the energy of the pendulum is kept."""
    moment, k, spin = 9.0, 40.0, 2.0
    upright = {"kind": "attitude", "K": [k] * 3, "L": [1e-9] * 3}
    data = config_data(
        {"upright": upright},
        None,
        body={"inertia": [10.0, 8.0, moment]},
        gravity=[0.0, 0.0, 0.0],
        initial={"orientation": [0.0, 0.0, 0.0], "angular_velocity": [0.0, 0.0, spin]},
        integration={"duration": 3.0, "samples": 61},
    )
    result = rbstab.simulate(data)
    angle, rate = result["orientation"][:, 2], result["angular_velocity"][:, 2]
    np.testing.assert_allclose(
        moment * rate**2 / 2 + k * (1 - np.cos(angle)), moment * spin**2 / 2, rtol=1e-8
    )
    # It turns round where k (1 - cos φ) is the first energy.
    turn = np.arccos(1 - moment * spin**2 / 2 / k)
    assert 0.9 * turn < angle.max() <= turn * (1 + 1e-9)
    assert angle.min() < 0


def test_guard_keeps_a_body_inside_the_range():
    """Without it, the same body leaves the range of eq. 5."""
    fast = {
        "controller": None,
        "gravity": [0.0, 0.0, 0.0],
        "initial": {"orientation": [0.0, 0.0, 0.0], "angular_velocity": [0.0, 6.0, 0.0]},
        "integration": {"duration": 2.0, "samples": 21},
    }
    free = rbstab.simulate(config_data({}, **fast))
    assert free.attributes["status"] == "range left"
    guard = {"kind": "guard", "method": "barrier", "stiffness": 10.0}
    kept = rbstab.simulate(config_data({"range": guard}, **fast))
    assert kept.attributes["status"] == "completed"
    # ½ · 8 · 36 J = ½ · 10 tan² θ2 at the turning point.
    top = np.arctan(np.sqrt(8.0 * 36.0 / 10.0))
    assert 0.9 * top < np.abs(kept["orientation"][:, 1]).max() <= top * (1 + 1e-9)
