"""A small violation of E = F = 0 of the held body grows, decays or is removed as it should."""

import numpy as np
import pytest
from support.problems import problem, solve
from support.systems import random_system

from rbstab.mechanics.motion import motion_from_contact
from rbstab.systems.coordinates import ManifoldCoordinates

TIMES = np.linspace(0.0, 1.0, 41)
E0 = np.array([2e-3, -1e-3, 3e-3])
F0 = np.array([-0.02, 0.05, 0.01])

# With an empty cache heyoka compiles these coordinates for eight seconds.
each_engine = pytest.mark.parametrize(
    "engine", ["scipy", pytest.param("heyoka", marks=pytest.mark.slow)]
)


def held_system(rate):
    return random_system(np.random.default_rng(7), "permanent", ManifoldCoordinates(rate))


def start_at(system, E, F):
    W = np.concatenate([[0.2, -0.3, 0.1], [1.0, -2.0, 1.5], E, F])
    return system.start(motion_from_contact(system.body, system.anchor, W), np.zeros(0))


def drift(engine, system, E, F, **changes):
    """Return E and F over time."""
    trajectory = solve(engine, problem(system, start_at(system, E, F), TIMES, **changes))
    assert trajectory.status == "completed"
    motions = [system.motion(state) for state in trajectory.states]
    return np.array([m.E for m in motions]), np.array([m.F for m in motions])


@each_engine
def test_without_control_the_offence_goes_on_at_its_speed(engine):
    # Eq. 17 makes Ë zero, not E.
    E, F = drift(engine, held_system(0.0), E0, F0)
    np.testing.assert_allclose(E, E0 + np.outer(TIMES, F0), rtol=0, atol=1e-12)
    np.testing.assert_allclose(F, np.broadcast_to(F0, F.shape), rtol=0, atol=1e-12)


def test_holding_force_works_on_an_offence_that_lasts():
    # ε of eq. 26 is ∫F'Λ dt; here F is constant, so ε = F0' ∫Λ dt.
    nodes, weights = np.polynomial.legendre.leggauss(30)
    times = np.concatenate([[0.0], (1.0 + nodes) / 4.0, [0.5]])
    system = held_system(0.0)
    trajectory = solve("scipy", problem(system, start_at(system, E0, F0), times))
    force = [system.observe(state).contact_force for state in trajectory.states[1:-1]]
    work = F0 @ (weights @ np.array(force)) / 4.0
    assert abs(work) > 0.1
    assert trajectory.contact_work[-1] == pytest.approx(work, rel=1e-9)


@each_engine
@pytest.mark.parametrize("rate", [3.0, 10.0])
def test_baumgarte_damps_the_offence_critically(engine, rate):
    E, F = drift(engine, held_system(rate), E0, F0)
    # The solution of Ë + 2αĖ + α²E = 0.
    decay = np.exp(-rate * TIMES)[:, None]
    slope = F0 + rate * E0
    np.testing.assert_allclose(E, decay * (E0 + np.outer(TIMES, slope)), rtol=0, atol=1e-12)
    expected = decay * (F0 - rate * np.outer(TIMES, slope))
    np.testing.assert_allclose(F, expected, rtol=0, atol=1e-12)


@each_engine
def test_projection_removes_the_offence_within_its_first_steps(engine):
    E, F = drift(engine, held_system(0.0), E0, F0, project=True)
    # From 0.2 s on only round-off remains, and heyoka's step between two projections.
    later = TIMES >= 0.2
    assert np.abs(E[later]).max() < 1e-14
    assert np.abs(F[later]).max() < 1e-13


def test_projection_is_done_at_every_step():
    # Projection happens at every step, not only at samples: after a first step of milliseconds the
    # body moves as if it had started from the projected state.
    system = held_system(0.0)
    start = start_at(system, E0, np.zeros(3))
    projected = solve("scipy", problem(system, start, [0.0, 1.0], project=True)).states[-1]
    put = solve("scipy", problem(system, start, [0.0, 1e-14], project=True)).states[-1]
    expected = solve("scipy", problem(system, put, [0.0, 1.0])).states[-1]
    left = solve("scipy", problem(system, start, [0.0, 1.0])).states[-1]
    assert np.abs(projected - expected).max() < 0.02 * np.abs(left - expected).max()
