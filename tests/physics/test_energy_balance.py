"""Energy balances along each motion: r = v(t) - v(0) - ∫v'dt is small, and eq. 28, 29 hold."""

import numpy as np
import pytest
from support.paper_runs import (
    CASE_NAMES,
    CASES,
    LOOSE_TOLERANCES,
    loose_run,
    paper_config,
    paper_run,
)
from support.problems import ENGINES, problem, solve
from support.systems import random_system

import rbstab
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector

each_case = pytest.mark.parametrize(("variant", "with_gravity"), CASES, ids=CASE_NAMES)
each_engine = pytest.mark.parametrize("engine", ENGINES)


@each_engine
@each_case
def test_v_falls_and_its_residual_is_small_at_the_default_tolerances(variant, with_gravity, engine):
    result = paper_run(variant, with_gravity, engine)
    v = result["lyapunov"]
    residual = v - v[0] - result["lyapunov_change"]
    assert np.abs(residual).max() < 1e-9 * v[0]
    np.testing.assert_allclose(result["energy_residual"], residual, rtol=0, atol=1e-9)
    # The balance means something only if v changes.
    assert v[-1] < 0.01 * v[0]
    assert (np.diff(v) < 0).all()
    assert v[-1] > 0


@pytest.mark.parametrize("drift_control", ["none", "projection", {"baumgarte": 20.0}], ids=str)
@pytest.mark.parametrize(
    # With an empty cache heyoka compiles these coordinates for eight seconds.
    "engine",
    ["scipy", pytest.param("heyoka", marks=pytest.mark.slow)],
)
def test_residual_is_small_on_the_sub_manifold(engine, drift_control):
    settings = {"coordinates": "manifold", "drift_control": drift_control, "engine": engine}
    result = rbstab.simulate(paper_config("permanent", with_gravity=True, samples=5, **settings))
    v = result["lyapunov"]
    assert np.abs(v - v[0] - result["lyapunov_change"]).max() < 1e-9 * v[0]
    # Here F is zero up to the error of integration; the work is that drift times 1e4 N.
    assert np.abs(result["contact_work"]).max() < 1e-8


@each_engine
def test_residual_falls_with_the_tolerance(engine):
    residuals = []
    for rtol in LOOSE_TOLERANCES:
        result = loose_run(engine, rtol)
        residuals.append(np.abs(result["energy_residual"]).max() / result["lyapunov"][0])
        assert residuals[-1] < rtol
    # About 100 each time; less where heyoka's order, a whole number, stayed the same.
    ratios = np.array(residuals[:-1]) / np.array(residuals[1:])
    assert (ratios > 5).all(), residuals


@each_engine
@pytest.mark.parametrize("with_gravity", [False, True])
def test_contact_force_does_no_work_on_a_held_body(with_gravity, engine):
    result = paper_run("permanent", with_gravity, engine)
    assert np.abs(result["contact_force"]).max() > 1e3
    np.testing.assert_array_equal(result["contact_work"], 0.0)


PANELS, NODES = 40, 10


def gauss_nodes(duration):
    """Return 0, Gauss nodes in panels, and the end: integrals are exact to round-off."""
    nodes, _ = np.polynomial.legendre.leggauss(NODES)
    edges = np.linspace(0.0, duration, PANELS + 1)
    middles, half = (edges[1:] + edges[:-1]) / 2, duration / PANELS / 2
    return np.concatenate([[0.0], (middles[:, None] + half * nodes).ravel(), [duration]])


def gauss_integral(values, duration):
    _, weights = np.polynomial.legendre.leggauss(NODES)
    return (values[1:-1].reshape(PANELS, NODES) @ weights).sum() * duration / PANELS / 2


@each_engine
@pytest.mark.parametrize("variant", ["visco-elastic", "embedded"])
def test_work_and_dissipation_balance_for_full_gains(variant, engine):
    # v_t + v_r + p - ε of eq. 28 has the rate -V'L_tV - Ω'L_rΩ of eq. 29, for any Λ. The integrals
    # ε of eq. 26 and ∫v'dt are compared with quadratures over the trace.
    rng = np.random.default_rng(5)
    system = random_system(rng, variant)
    Z = np.concatenate([[0.2, -0.3, 0.1], [2.0, -3.0, 1.0], rng.normal(size=6) * 0.1])
    start = np.concatenate([Z, rng.normal(size=system.size - 12) * 0.05])
    duration = 1.0
    trajectory = solve(engine, problem(system, start, gauss_nodes(duration)))
    assert trajectory.status == "completed"
    seen = [system.observe(state) for state in trajectory.states]
    V, Omega, X, Theta, F = (
        np.array([getattr(o.motion, symbol) for o in seen])
        for symbol in ("V", "Omega", "X", "Theta", "F")
    )
    force = np.array([o.contact_force for o in seen])
    gravity, translational, rotational = system.elements[:3]
    assert isinstance(gravity, Gravity)
    assert isinstance(translational, TranslationalStabilizer)
    assert isinstance(rotational, RotationalStabilizer)

    def form(matrix, x):
        return np.einsum("ti,ij,tj->t", x, matrix, x)

    body = system.body
    stored = 0.5 * (
        body.mass * (V**2).sum(axis=1)
        + form(body.inertia, Omega)
        + form(translational.K_t, X)
        + form(rotational.K_r, Theta)
    )
    p = -X @ gravity.weight
    lost = form(translational.L_t, V) + form(rotational.L_r, Omega)
    work = gauss_integral((F * force).sum(axis=1), duration)
    scale = stored[0]
    assert abs(work) > 1e-3 * scale
    assert trajectory.contact_work[0] == 0
    assert trajectory.contact_work[-1] == pytest.approx(work, rel=0, abs=1e-10 * scale)
    gained = (stored + p)[-1] - (stored + p)[0] - trajectory.contact_work[-1]
    assert gained == pytest.approx(-gauss_integral(lost, duration), rel=0, abs=1e-10 * scale)

    connector = system.elements[3]
    assert isinstance(connector, ViscoElasticConnector | EmbeddedConnector)
    at_connector = form(connector.L_c, F)
    if isinstance(connector, EmbeddedConnector):
        D = np.array([o.own_states for o in seen])
        E = np.array([o.motion.E for o in seen])
        pull = (E - D) @ connector.K_c - D @ connector.K_d  # = L_d Ḋ
        at_connector = at_connector + form(np.linalg.inv(connector.L_d), pull)
    rate = -lost - at_connector
    assert trajectory.lyapunov_change[0] == 0
    assert trajectory.lyapunov_change[-1] == pytest.approx(
        gauss_integral(rate, duration), rel=0, abs=1e-10 * scale
    )
