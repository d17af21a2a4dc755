"""Motors with a limit or a lag, against equations of motion and matrices that are written here."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import rbstab
from rbstab.experiment.along.locus import linearised_at_rest

PAPER = "configs/paper/case1_permanent.yaml"
MASS, J = 41.0, np.diag([10.0, 8.0, 0.4])
R = np.array([0.15, 0.10, -0.42])
K_t, L_t = np.array([4100.0, 4100, 3280]), np.array([210.0, 210, 140])
K_r, L_r = np.array([400.0, 400, 320]), np.array([60.0, 60, 42])
SPIN = np.array([16.0, 32.0, -16.0])
H_PEAK, N_PEAK = np.array([3308.0, 1465, 2408]), np.array([1675.0, 4848, 672])
"""The largest force and couple of the first case without limits, by component, rounded."""

J_C = J + MASS * (R @ R * np.eye(3) - np.outer(R, R))


def turn(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix = np.eye(3)
    matrix[i, i], matrix[j, j], matrix[i, j], matrix[j, i] = c, c, -s, s
    return matrix


def spins(Theta):
    """The columns are the spins, in the body, of unit rates of the three angles in turn."""
    back = turn(2, Theta[2]).T
    return np.column_stack([back @ turn(1, Theta[1]).T[:, 0], back[:, 1], [0, 0, 1.0]])


def limited(total, limit):
    return total / np.sqrt(1.0 + (total / limit) ** 2)


def held_body(motors):
    """The rates of [Θ, Ω, other states] of the body held at C: moments about C, in the body.

    `motors` gets Θ, its rates, Ω, X, V, the spins of the angles, and the other states. It returns
    the force H, inertial, the couples on the Euler angles, a couple in the body, and the rates of
    the other states.
    """

    def rates(_, y):
        Theta, Omega, others = y[:3], y[3:6], y[6:]
        A, W = turn(0, Theta[0]) @ turn(1, Theta[1]) @ turn(2, Theta[2]), spins(Theta)
        rate = np.linalg.solve(W, Omega)
        X, V = R - A @ R, A @ np.cross(R, Omega)  # G is at -R from C
        H, on_angles, on_body, of_others = motors((Theta, rate, Omega, X, V, W), others)
        moment = np.cross(-R, A.T @ H) + np.linalg.solve(W.T, on_angles) + on_body
        spin_up = np.linalg.solve(J_C, moment - np.cross(Omega, J_C @ Omega))
        return np.concatenate([rate, spin_up, of_others])

    return rates


def clamped(total, limit):
    return np.clip(total, -limit, limit)


def smooth_limit(H_max, N_max, *, body_axes=False, limited=limited):
    def motors(seen, others):
        Theta, rate, Omega, X, V, W = seen
        H, none = -limited(K_t * X + L_t * V, H_max), np.zeros(3)
        if body_axes:
            in_body = np.linalg.solve(W.T, K_r * Theta) + L_r * Omega
            return H, none, -limited(in_body, N_max), others
        return H, -limited(K_r * Theta + L_r * rate, N_max), none, others

    return motors


def first_order_lag(tau):
    """H and the couples on the angles are states of their own: the plain equation of a lag."""

    def motors(seen, others):
        Theta, rate, _, X, V, _ = seen
        H, n = np.split(others, 2)
        told = np.concatenate([-(K_t * X + L_t * V), -(K_r * Theta + L_r * rate)])
        return H, n, np.zeros(3), (told - others) / tau

    return motors


def followed(motors, others=(), spin=SPIN, duration=1.0):
    start = np.concatenate([np.zeros(3), spin, others])
    solution = solve_ivp(held_body(motors), (0, duration), start, "DOP853", rtol=1e-11, atol=1e-11)
    return solution.y[:6, -1]


def run_of(actuators, engine="scipy", spin=SPIN, duration=1.0):
    numbers = [f"integration.duration={duration}", f"integration.engine={engine}"]
    numbers.append(f"initial.angular_velocity={spin.tolist()}")
    settings = {"limit": None, "lag": None} | actuators
    chosen = {key: value for key, value in settings.items() if value is not None}
    config = rbstab.load_config(PAPER, [f"controller.actuators={chosen}", *numbers])
    return rbstab.simulate(config)


def end_of(run):
    return np.concatenate([run["orientation"][-1], run["angular_velocity"][-1]])


def limits(share):
    return {"H": (share * H_PEAK).tolist(), "N": (share * N_PEAK).tolist()}


@pytest.mark.parametrize("engine", ["scipy", "heyoka"])
@pytest.mark.parametrize(
    ("axes", "law"), [("euler", "smooth"), ("body", "smooth"), ("euler", "hard")]
)
def test_a_limited_motion_is_that_of_other_equations(engine, axes, law):
    share, law_of = 0.4, {"smooth": limited, "hard": clamped}[law]
    run = run_of({"limit": limits(share), "axes": axes, "law": law}, engine)
    sizes = share * H_PEAK, share * N_PEAK
    motors = smooth_limit(*sizes, body_axes=axes == "body", limited=law_of)
    np.testing.assert_allclose(end_of(run), followed(motors), atol=1e-7)
    # Steps that end on the switches keep the energy, too.
    assert np.abs(run["energy_residual"]).max() < 1e-11 * run["lyapunov"][0]


@pytest.mark.parametrize("tau", [0.03, 0.07])  # passive, and not
def test_a_lagging_motion_is_that_of_a_plain_lag(tau):
    """z = 0 at the start is H = -K_t X = 0 there, and so for N."""
    run = run_of({"lag": tau})
    np.testing.assert_allclose(end_of(run), followed(first_order_lag(tau), np.zeros(6)), atol=1e-7)


def test_without_a_limit_that_is_felt_nothing_changes():
    huge = {"H": [1e9] * 3, "N": [1e9] * 3}
    plain = rbstab.simulate(rbstab.load_config(PAPER, ["integration.duration=1.0"]))
    run = run_of({"limit": huge, "axes": "body"})
    np.testing.assert_allclose(end_of(run), end_of(plain), atol=1e-8)
    only_force = run_of({"limit": {"H": huge["H"]}})
    np.testing.assert_allclose(end_of(only_force), end_of(plain), atol=1e-8)
    # In Euler axes the damping is that of the rates of the angles.
    slow = 0.4 * SPIN
    damped, told = (
        followed(smooth_limit(np.inf, np.inf), spin=slow),
        run_of({"limit": huge}, spin=slow),
    )
    np.testing.assert_allclose(end_of(told), damped, atol=1e-7)
    on_body = followed(smooth_limit(np.inf, np.inf, body_axes=True), spin=slow)
    assert np.abs(damped - on_body).max() > 1e-3
    # The energy keeps its digits, too.
    for limited_run in (run, only_force):
        assert np.abs(limited_run["energy_residual"]).max() < 1e-10 * limited_run["lyapunov"][0]


def test_a_short_lag_is_hardly_felt():
    """In the limit of no lag it is the damping of the rates of the angles, as with a limit."""
    slow = 0.4 * SPIN
    plain = followed(smooth_limit(np.inf, np.inf), spin=slow)
    ends = [end_of(run_of({"lag": tau}, spin=slow)) for tau in (2e-3, 1e-3)]
    far = [np.abs(end - plain).max() for end in ends]
    assert far[1] < 0.6 * far[0] < 0.05


def test_passive_motors_never_raise_the_energy_and_others_are_audited():
    """Only the limit in body axes supplies, and what v does is what was supplied and lost."""
    for axes, share in (("euler", 0.1), ("body", 0.1)):
        run = run_of({"limit": limits(share), "axes": axes}, duration=5.0)
        v = run["lyapunov"]
        assert np.abs(run["energy_residual"]).max() < 1e-9 * v[0]
        assert ("supplied_energy" in run) == (axes == "body")
        if axes == "euler":
            assert np.all(np.diff(v) <= 1e-12 * v[0])
        else:
            supplied = run["supplied_energy"]
            assert np.abs(supplied).max() > 0.01 * v[0]
            lost = supplied - run["lyapunov_change"]
            assert np.all(np.diff(lost) >= -1e-12 * v[0])


def matrix_of_lag(tau):
    """The linear body at rest with motors that lag: [θ, dθ/dt, H, n], and dX = θ × -R."""
    to_X = np.array([np.cross(e, -R) for e in np.eye(3)]).T
    M, none, eye = np.linalg.inv(J_C), np.zeros((3, 3)), np.eye(3)
    return np.block(
        [
            [none, eye, none, none],
            [none, none, M @ to_X.T, M],
            [-np.diag(K_t) @ to_X / tau, -np.diag(L_t) @ to_X / tau, -eye / tau, none],
            [-np.diag(K_r) / tau, -np.diag(L_r) / tau, none, -eye / tau],
        ]
    )


def modes_of(config):
    linearisation = linearised_at_rest(config).linearisation
    assert linearisation is not None
    return linearisation.eigenvalues


def growth(tau):
    return np.linalg.eigvals(matrix_of_lag(tau)).real.max()


@pytest.mark.parametrize("tau", [0.03, 0.06, 0.12])
def test_the_modes_of_a_lag_are_those_of_a_plain_lag(tau):
    config = rbstab.load_config(PAPER, [f"controller.actuators={{lag: {tau}}}"])
    modes = modes_of(config)
    expected = np.linalg.eigvals(matrix_of_lag(tau))
    for mode in expected:
        # -1/τ is there more than once, and a double eigenvalue has half of the digits.
        assert np.abs(modes - mode).min() < 1e-5 * abs(mode)
    assert modes.real.max() == pytest.approx(growth(tau), rel=1e-9)


def test_the_first_case_is_stable_up_to_a_lag_of_0_0845_s():
    border = brentq(growth, 0.05, 0.12)
    assert border == pytest.approx(0.0845, abs=5e-5)
    for tau, stable in ((border * 0.999, True), (border * 1.001, False)):
        config = rbstab.load_config(PAPER, [f"controller.actuators={{lag: {tau}}}"])
        assert (modes_of(config).real.max() < 0) == stable


def test_convergence_survives_small_motors():
    """Down to a twentieth of the largest couples the body of the paper comes to rest."""
    settling_times = {}
    for share, duration in ((0.5, 4.0), (0.2, 5.0), (0.1, 15.0), (0.05, 40.0)):
        run = run_of({"limit": limits(share)}, duration=duration)
        assert run.status == "completed"
        settling_times[share] = float(run["settling_time"])
        assert np.abs(run["orientation"][-1]).max() < 0.05
    assert (
        settling_times[0.5] < settling_times[0.2] < settling_times[0.1] < settling_times[0.05] < 40
    )
