"""Connectors with a limit or a lag, against equations of motion that are written here."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.spatial.transform import Rotation

import rbstab

MASS, J = 12.0, np.diag([0.9, 0.7, 0.4])
R = np.array([0.15, 0.10, -0.42])
K_t, L_t, L_r = np.array([400.0, 300, 500]), np.array([20.0, 30, 25]), np.array([4.0, 5, 6])
K_c, L_c = np.array([900.0, 700, 500]), np.array([60.0, 40, 50])
K_d, L_d = np.array([600.0, 500, 800]), np.array([50.0, 90, 70])
M = np.array([50.0, 60, 40])
GRAVITY = np.array([0.0, 0, -9.81])
SPIN, DURATION = np.array([5.0, -4.0, 6.0]), 1.0


def run_of(actuators, variant="visco-elastic", engine="scipy", law=None):
    numbers = {"K_t": K_t, "L_t": L_t, "L_r": L_r, "K_c": K_c, "L_c": L_c}
    if variant == "embedded":
        numbers |= {"K_d": K_d, "L_d": L_d}
    gains = {name: value.tolist() for name, value in numbers.items()}
    config = {
        "body": {"mass": MASS, "inertia": np.diag(J).tolist(), "contact_point": R.tolist()},
        "gravity": GRAVITY.tolist(),
        "controller": {"variant": variant, **gains, "connector_actuators": actuators},
        "initial": {"angular_velocity": SPIN.tolist()},
        "integration": {"duration": DURATION, "engine": engine},
    }
    return rbstab.simulate(rbstab.load_config(config))


def followed(force_and_rates, others):
    """Follow the body in quaternions: [quaternion, Ω, X, V, other states] at the end.

    `force_and_rates` gets E, F and the other states, and returns the force at C and their rates.
    """

    def rates(_, y):
        q, Omega, X, V, states = y[:4], y[4:7], y[7:10], y[10:13], y[13:]
        A = Rotation.from_quat(q).as_matrix()
        E, F = X + A @ R - R, V + A @ np.cross(Omega, R)
        force, of_states = force_and_rates(E, F, states)
        spun = np.append(
            0.5 * (q[3] * Omega + np.cross(q[:3], Omega)), -0.5 * q[:3] @ Omega
        )  # scalar last, Ω in the body
        couple = -L_r * Omega + np.cross(R, A.T @ force)
        Omega_rate = np.linalg.solve(J, couple - np.cross(Omega, J @ Omega))
        V_rate = (-K_t * X - L_t * V + force) / MASS + GRAVITY
        return np.concatenate([spun, Omega_rate, V, V_rate, of_states])

    start = np.concatenate([[0, 0, 0, 1], SPIN, np.zeros(6), others])
    solution = solve_ivp(rates, (0, DURATION), start, "DOP853", rtol=1e-11, atol=1e-12)
    return solution.y[:, -1]


def soft(total):
    return total / np.sqrt(1.0 + (total / M) ** 2)


def clamped(total):
    return np.clip(total, -M, M)


def assert_ends_alike(run, end):
    A = Rotation.from_quat(end[:4]).as_matrix()
    turned = Rotation.from_euler("XYZ", run["orientation"][-1]).as_matrix()
    np.testing.assert_allclose(turned, A, atol=1e-7)
    for name, expected in (
        ("angular_velocity", end[4:7]),
        ("position", end[7:10]),
        ("velocity", end[10:13]),
    ):
        np.testing.assert_allclose(run[name][-1], expected, atol=1e-7)
    # What v does is what was lost and supplied.
    assert np.abs(run["energy_residual"]).max() < 1e-10 * run["lyapunov"][0]


@pytest.mark.parametrize("engine", ["scipy", "heyoka"])
@pytest.mark.parametrize(("law", "sat"), [("smooth", soft), ("hard", clamped)])
def test_a_connector_with_a_limit_moves_a_body_as_other_equations_say(engine, law, sat):
    run = run_of({"limit": M.tolist(), "law": law}, engine=engine)
    end = followed(lambda E, F, _: (-sat(K_c * E + L_c * F), np.zeros(0)), np.zeros(0))
    assert_ends_alike(run, end)
    reached = np.abs(run["contact_force"]).max(axis=0)
    assert np.all(reached <= M * (1 + 1e-12))
    assert np.all(reached > 0.7 * M)  # so the limit is felt
    assert "supplied_energy" not in run


@pytest.mark.parametrize(("tau", "passive"), [(0.05, True), (0.09, False)])
def test_a_connector_with_a_lag_is_a_first_order_lag_of_its_force(tau, passive):
    """The least eigenvalue of K⁻¹L is 40/700 s."""
    run = run_of({"lag": tau})
    end = followed(lambda E, F, f: (f, (-K_c * E - L_c * F - f) / tau), np.zeros(3))
    assert_ends_alike(run, end)
    assert ("supplied_energy" not in run) == passive


@pytest.mark.parametrize("engine", ["scipy", "heyoka"])
def test_the_limited_spring_of_an_embedded_connector_drives_its_state(engine):
    def force_and_rates(E, F, D):
        spring = K_c * (E - D)
        return -soft(spring + L_c * F), (soft(spring) - K_d * D) / L_d

    run = run_of({"limit": M.tolist()}, "embedded", engine)
    end = followed(force_and_rates, np.zeros(3))
    assert_ends_alike(run, end)
    D = run["connector_state"]
    np.testing.assert_allclose(D[-1], end[13:], atol=1e-8)
    assert np.all(np.diff(run["lyapunov"]) <= 1e-12 * run["lyapunov"][0])
    # What it stores, by quadrature of its force along each axis.
    stretch = run["contact_displacement"] - D
    for k in (100, -1):
        of_spring = sum(
            quad(lambda x, i=i: soft(np.full(3, K_c[i] * x))[i], 0, stretch[k, i])[0]
            for i in range(3)
        )
        stored = of_spring + 0.5 * D[k] @ (K_d * D[k])
        parts = dict(zip(run["part"], run["energy"][k], strict=True))
        assert parts["connector"] == pytest.approx(stored, rel=1e-10)


def test_a_limit_that_is_not_felt_leaves_an_embedded_connector_as_it_is():
    huge = run_of({"limit": [1e9] * 3}, "embedded")
    end = followed(
        lambda E, F, D: (-K_c * (E - D) - L_c * F, (K_c * (E - D) - K_d * D) / L_d), np.zeros(3)
    )
    assert_ends_alike(huge, end)
