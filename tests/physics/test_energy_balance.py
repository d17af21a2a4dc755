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


def gauss_nodes(duration, panels=40):
    """Return the times of Gauss's rule in panels, and its weights: exact to round-off here."""
    nodes, weights = np.polynomial.legendre.leggauss(10)
    half = duration / panels / 2
    middles = half * np.arange(1, 2 * panels, 2)
    return (middles[:, None] + half * nodes).ravel(), half * np.tile(weights, panels)


@each_engine
@pytest.mark.parametrize("variant", ["visco-elastic", "embedded"])
def test_work_and_dissipation_are_the_integrals_of_their_powers(variant, engine):
    """ε of eq. 26 and ∫v'dt of eq. 43 and 46, with full gains, against quadrature."""
    rng = np.random.default_rng(5)
    system = random_system(rng, variant)
    Z = np.concatenate([[0.2, -0.3, 0.1], [2.0, -3.0, 1.0], rng.normal(size=6) * 0.1])
    start = np.concatenate([Z, rng.normal(size=system.size - 12) * 0.05])
    times, weights = gauss_nodes(1.0)
    trajectory = solve(engine, problem(system, start, [0.0, *times, 1.0]))
    assert trajectory.status == "completed"
    seen = [system.observe(state) for state in trajectory.states]
    scale = seen[0].energy.sum()
    powers = np.array([(o.motion.F @ o.contact_force, -o.dissipation.sum()) for o in seen])
    integrals = np.array([trajectory.contact_work, trajectory.lyapunov_change]).T
    assert (integrals[0] == 0).all()
    assert (np.abs(integrals[-1]) > 1e-3 * scale).all()
    np.testing.assert_allclose(integrals[-1], weights @ powers[1:-1], rtol=0, atol=1e-10 * scale)
