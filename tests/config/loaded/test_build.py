"""Each number of a config reaches the right place of the system and of the problem."""

import numpy as np
import pytest
from support.configs import BY_VARIANT, EMBEDDED, FREE, PERMANENT, VISCO_ELASTIC, plain
from support.systems import random_state

from rbstab.config.build import problem_of, system_of
from rbstab.config.load import load_config
from rbstab.config.warnings import config_warnings
from rbstab.systems.coordinates import ManifoldCoordinates

HELD = ("reduced", "manifold")


def config_of(text, *changes):
    return load_config(plain(text), changes)


def full(diagonal):
    return np.diag(diagonal).tolist()


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_a_diagonal_and_its_matrix_are_one_system(variant):
    data = plain(BY_VARIANT[variant])
    as_matrices = plain(BY_VARIANT[variant])
    as_matrices["body"]["inertia"] = full(data["body"]["inertia"])
    for key, value in data["controller"].items():
        if isinstance(value, list):
            as_matrices["controller"][key] = full(value)
    one, other = system_of(load_config(data)), system_of(load_config(as_matrices))
    rng = np.random.default_rng(1)
    for _ in range(3):
        y = random_state(rng, one)
        assert np.array_equal(one.rates(y), other.rates(y))


def test_potential_energy_by_hand():
    """The energy is ½ x'Kx of the springs that are stretched."""
    system = system_of(config_of(EMBEDDED))
    y = np.zeros(system.size)
    assert system.potential_energy(y) == 0.0
    y[2] = 0.1  # θ3 alone: it stretches the rotational spring and the connector
    R = np.array([0.15, 0.10, -0.42])
    turn = np.array([[np.cos(0.1), -np.sin(0.1), 0], [np.sin(0.1), np.cos(0.1), 0], [0, 0, 1]])
    E = turn @ R - R
    expected = 0.5 * 320 * 0.1**2 + 0.5 * E @ (np.array([12300, 12300, 9840]) * E)
    assert system.potential_energy(y) == pytest.approx(expected, rel=1e-13)
    y[:] = 0
    y[12:] = (0.1, 0.2, 0.3)  # D alone stretches both springs of the connector
    D = y[12:]
    expected = 0.5 * D @ ((np.array([12300, 12300, 9840]) * 2) * D)
    assert system.potential_energy(y) == pytest.approx(expected, rel=1e-13)


# Four gains whose entries all differ: a mix-up would show.
DISTINCT = ("K_c=[2, 3, 5]", "L_c=[7, 11, 13]", "K_d=[17, 19, 23]", "L_d=[29, 31, 37]")
K_c, L_c, K_d, L_d = np.array([[2, 3, 5], [7, 11, 13], [17, 19, 23], [29, 31, 37]])


@pytest.mark.parametrize("variant", ["visco-elastic", "embedded"])
def test_each_gain_of_the_connector_by_itself(variant):
    """At Θ = Ω = 0 the contact point moves like the centre: E = X, F = V."""
    count = 2 if variant == "visco-elastic" else 4
    changes = [f"controller.{gain}" for gain in DISTINCT[:count]]
    system = system_of(config_of(BY_VARIANT[variant], *changes))
    pull, push = np.array([0.1, 0.2, 0.3]), np.array([4.0, 5.0, 6.0])
    y = np.zeros(system.size)
    y[6:9] = pull
    np.testing.assert_allclose(system.observe(y).contact_force, -K_c * pull, rtol=1e-14)
    y[6:9], y[9:12] = 0, push
    np.testing.assert_allclose(system.observe(y).contact_force, -L_c * push, rtol=1e-14)
    if variant == "embedded":
        y[9:12], y[12:15] = 0, pull
        np.testing.assert_allclose(system.observe(y).contact_force, K_c * pull, rtol=1e-14)
        # Both springs of the inner point pull it back, against its damper.
        np.testing.assert_allclose(system.rates(y)[12:], -(K_c + K_d) * pull / L_d, rtol=1e-14)


def test_each_gain_of_the_stabilizers_by_itself():
    gains = ("K_t=[2, 3, 5]", "L_t=[7, 11, 13]", "K_r=[17, 19, 23]", "L_r=[29, 31, 37]")
    system = system_of(config_of(FREE, *(f"controller.{gain}" for gain in gains)))
    y = np.concatenate([np.zeros(3), [1, 0, 2], [0.1, 0.2, 0.3], np.zeros(3)])
    at = system.observe(y)
    force, couple = (sum(w[k] for w in at.wrenches) for k in (0, 1))
    np.testing.assert_allclose(force, -np.array([2, 3, 5]) * y[6:9], rtol=1e-14)
    np.testing.assert_allclose(couple, -np.array([29, 31, 37]) * y[3:6], rtol=1e-14)
    y = np.concatenate([[0.25, 0, 0], np.zeros(6), [4.0, 5.0, 6.0]])
    at = system.observe(y)
    force, couple = (sum(w[k] for w in at.wrenches) for k in (0, 1))
    np.testing.assert_allclose(force, -np.array([7, 11, 13]) * y[9:12], rtol=1e-14)
    np.testing.assert_allclose(couple, [-17 * 0.25, 0, 0], rtol=1e-14)  # about axis 1 alone, B = 1


def test_a_body_at_rest_falls_with_gravity():
    g = (0.3, -0.2, -9.81)
    problem = problem_of(config_of(FREE, f"gravity={list(g)}", "initial={}"))
    rates = problem.system.rates(problem.start)
    assert rates[9:12] == pytest.approx(g, rel=1e-14)
    assert not rates[:9].any()


@pytest.mark.parametrize("text", [PERMANENT, VISCO_ELASTIC, EMBEDDED])
def test_anchor(text):
    """The anchor is zero, or the X where the loaded spring balances: K_t X = m g."""
    g = np.array([1.0, -2.0, -9.81])
    change = f"gravity={g.tolist()}"
    assert not system_of(config_of(text, change)).anchor.any()
    system = system_of(config_of(text, change, "controller.anchor=equilibrium"))
    assert system.anchor == pytest.approx(41.0 * g / np.array([4100, 4100, 3280]), rel=1e-14)
    K = np.array([[4000.0, 500, 0], [500, 3000, 200], [0, 200, 5000]])
    changes = (change, "controller.anchor=equilibrium", f"controller.K_t={K.tolist()}")
    system = system_of(config_of(text, *changes))
    assert K @ system.anchor == pytest.approx(41.0 * g, rel=1e-12)


@pytest.mark.parametrize("coordinates", HELD)
@pytest.mark.parametrize("anchor", ["origin", "equilibrium"])
def test_the_held_body_starts_on_the_sub_manifold(coordinates, anchor):
    problem = problem_of(
        config_of(
            PERMANENT,
            f"integration.coordinates={coordinates}",
            f"controller.anchor={anchor}",
            "gravity=[1, 2, -9.81]",
            "initial.orientation=[0.3, -0.4, 0.5]",
        )
    )
    motion = problem.system.motion(problem.start)
    assert motion.Theta.tolist() == [0.3, -0.4, 0.5]
    assert motion.Omega.tolist() == [16.0, 32.0, -16.0]
    assert np.abs(motion.E).max() < 1e-15
    assert np.abs(motion.F).max() < 1e-14
    assert len(problem.start) == {"reduced": 6, "manifold": 12}[coordinates]


START = (
    "initial.orientation=[0.3, -0.4, 0.5]",
    "initial.position=[1, 2, 3]",
    "initial.velocity=[4, 5, 6]",
)


@pytest.mark.parametrize("coordinates", ["Z", "W"])
@pytest.mark.parametrize("text", [FREE, VISCO_ELASTIC, EMBEDDED])
def test_the_start_is_the_one_that_was_given(text, coordinates):
    problem = problem_of(config_of(text, *START, f"integration.coordinates={coordinates}"))
    motion = problem.system.motion(problem.start)
    assert motion.Theta.tolist() == [0.3, -0.4, 0.5]
    assert motion.Omega.tolist() == [16.0, 32.0, -16.0]
    np.testing.assert_allclose(motion.X, [1, 2, 3], rtol=1e-14)
    np.testing.assert_allclose(motion.V, [4, 5, 6], rtol=1e-13)
    assert problem.system.coordinates.name == coordinates


def test_the_connector_starts_in_its_state():
    assert problem_of(config_of(EMBEDDED)).start[12:].tolist() == [0, 0, 0]
    problem = problem_of(config_of(EMBEDDED, "initial.connector_state=[7, 8, 9]"))
    assert problem.start[12:].tolist() == [7, 8, 9]


def test_settings_arrive():
    changes = [
        "integration.duration=3",
        "integration.samples=7",
        "integration.rtol=1e-7",
        "integration.atol=1e-8",
        "integration.method=Radau",
        "integration.range_bound=0.2",
        "integration.step_limit=55",
        "integration.time_limit=66",
    ]
    problem = problem_of(config_of(VISCO_ELASTIC, *changes))
    assert problem.times.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert (problem.rtol, problem.atol, problem.method) == (1e-7, 1e-8, "Radau")
    assert (problem.range_bound, problem.step_limit, problem.time_limit) == (0.2, 55, 66)
    assert problem.project is False


def test_drift_control():
    manifold = "integration.coordinates=manifold"
    assert problem_of(config_of(PERMANENT)).project is False
    assert problem_of(config_of(PERMANENT, manifold)).project is False
    projected = problem_of(config_of(PERMANENT, manifold, "integration.drift_control=projection"))
    assert projected.project is True
    assert isinstance(projected.system.coordinates, ManifoldCoordinates)
    assert projected.system.coordinates.baumgarte_rate == 0.0
    changes = (manifold, "integration.drift_control={baumgarte: 5}")
    damped = problem_of(config_of(PERMANENT, *changes))
    assert damped.project is False
    assert isinstance(damped.system.coordinates, ManifoldCoordinates)
    assert damped.system.coordinates.baumgarte_rate == 5.0


def test_the_triangle_is_judged_by_principal_moments():
    """The matrix is diag(10, 8, 0.4) in turned axes, so its diagonal does not show the moments."""
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array(
        [[1, 0, 0], [0, c, -s], [0, s, c]]
    )
    matrix = turn @ np.diag([10, 8, 0.4]) @ turn.T
    matrix = (0.5 * (matrix + matrix.T)).tolist()
    (warning,) = config_warnings(config_of(VISCO_ELASTIC, f"body.inertia={matrix}"))
    assert "10 > 8 + 0.4" in warning


@pytest.mark.parametrize(("stiffness", "warned"), [(1e-6, True), (40.0, True), (50.0, False)])
def test_an_anchor_far_from_the_origin_has_a_warning(stiffness, warned):
    weight = ["body.mass=41", "gravity=[0,0,-10]", "body.inertia=[1,1,1]"]  # sags by 410/K_t m
    gains = f"controller.K_t=[{stiffness},{stiffness},{stiffness}]"
    at_origin = config_of(VISCO_ELASTIC, gains, *weight)
    assert config_warnings(at_origin) == []
    found = config_warnings(
        config_of(VISCO_ELASTIC, gains, *weight, "controller.anchor=equilibrium")
    )
    # So far away, the connector pulls with a force that makes the motion fast as well.
    assert sum(line.startswith("controller.anchor") for line in found) == warned
