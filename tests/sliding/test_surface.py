"""On the surface s = F + κE, of relative degree one, the point slides in finite time."""

import numpy as np
import pytest
from support.problems import ENGINES
from support.sliding import SLOPE_REFERENCE, paper_problem, solve_sliding


@pytest.fixture(scope="module", params=ENGINES)
def strong(request):
    return solve_sliding(request.param, paper_problem(20000, slope=20.0))


@pytest.fixture(scope="module", params=ENGINES)
def weak(request):
    return solve_sliding(request.param, paper_problem(2000, slope=20.0, duration=1.0))


def test_three_axes_start_to_slide_when_they_should(strong):
    expected = [float(event["t"]) for event in SLOPE_REFERENCE["events"]]
    assert strong.switches.switch_times == pytest.approx(expected, abs=1e-9)
    assert [str(kind) for _, _, kind in strong.switches.transitions] == ["stick"] * 3
    sides = [event["mode_after"] for event in SLOPE_REFERENCE["events"]]
    stuck = [axis for _, axis, _ in strong.switches.transitions]
    assert [side.count(0) for side in sides] == [1, 2, 3]
    assert [sides[k][axis] for k, axis in enumerate(stuck)] == [0, 0, 0]


@pytest.mark.parametrize("state", SLOPE_REFERENCE["states"], ids=lambda state: f"t={state['t']}")
def test_states_are_the_reference(strong, state):
    """Another program computed them with 34 digits."""
    row = int(np.flatnonzero(np.isclose(strong.times, state["t"]))[0])
    motion = strong.systems[row].motion(strong.states[row])
    for name in ("Theta", "Omega", "X", "V", "E", "F"):
        assert getattr(motion, name) == pytest.approx(state[name], abs=1e-9), name
    force = strong.systems[row].observe(strong.states[row]).contact_force
    assert force == pytest.approx(state["Lam"], rel=1e-9, abs=1e-7)


def test_displacement_decays_as_the_surface_says(strong):
    """On the surface Ė = -20 E."""
    E = strong.states[:, 6:9]
    first = 1  # the first sample after the last axis sticks, at 0.05 s
    expected = E[first] * np.exp(-20.0 * (strong.times[first:, None] - strong.times[first]))
    assert E[first:] == pytest.approx(expected, abs=1e-12)


def test_work_balances_without_a_potential(strong):
    """v - ε of eq. 28 balances: energy of body and stabilizers minus the connector's work."""
    energy = [s.observe(y).energy.sum() for s, y in zip(strong.systems, strong.states, strict=True)]
    value = np.array(energy) - strong.contact_work
    assert np.abs(value - value[0] - strong.lyapunov_change).max() < 1e-10 * value[0]


def test_the_equivalent_force_stays_in_its_box(strong, weak):
    for run, K_s in ((strong, 20000.0), (weak, 2000.0)):
        forces = np.array(
            [s.observe(y).contact_force for s, y in zip(run.systems, run.states, strict=True)]
        )
        assert np.abs(forces).max() <= K_s * (1 + 1e-12)
        off = run.switches.modes != 0
        assert forces[off] == pytest.approx(-K_s * run.switches.modes[off])
