"""On s = E the right axes stick, by the right impulse, and the lost energy is counted."""

from dataclasses import replace

import numpy as np
import pytest
from support.problems import each_engine
from support.sliding import (
    by_modes,
    connector,
    paper_problem,
    pushed_ball,
    sides_and_holds,
    solve_sliding,
)

from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching.chatter import Chatter, most_axes_stick
from rbstab.systems.connector import with_connector

STATE = np.array([0.2, -0.3, 0.4, 3.0, 5.0, -4.0, 0.0, 0.0, 0.0, 0.3, -0.2, 0.4, 7.0, 8.0])
"""Θ, Ω, E = 0, F, and the two integrals of energy, which sticking does not change."""


def stick_of(problem, y, held=(0, 0, 0)):
    """Return how the point sticks; None if no axis may."""
    sides = [0 if is_held else 1 for is_held in held]
    return most_axes_stick(by_modes(problem, sides, held), y)


def bound_by(K_s):
    """Return the paper's body with other bounds."""
    problem = paper_problem(1.0, stick_energy=1.0)
    bounds = replace(connector(1.0), K_s=np.array(K_s, dtype=float))
    return replace(problem, system=with_connector(problem.system, bounds))


def mobility(y):
    """Return W, and S = J⁻¹ŘA', which turns an impulse at C into a change of Ω."""
    system = bound_by([1, 1, 1]).system
    body, motion = system.body, system.motion(y[:12])
    lever = np.cross(body.contact_point, np.eye(3)).T @ motion.A.T
    turn = np.linalg.inv(body.inertia) @ lever
    return np.eye(3) / body.mass + lever.T @ turn, turn


def at(F):
    y = STATE.copy()
    y[9:12] = F
    return y


@pytest.mark.parametrize(
    ("F", "held"), [([0.3, -0.2, 0.4], (0, 0, 0)), ([0.0, -0.2, 0.4], (1, 0, 0))]
)
def test_the_impulse_takes_the_velocity_of_every_axis(F, held):
    """p = -W⁻¹F changes Ω by Sp and V by p/m, and ½F'W⁻¹F is lost, also with held axes."""
    y, problem = at(F), bound_by([1e6, 1e6, 1e6])
    system = problem.system
    stuck = stick_of(problem, y, held)
    W, turn = mobility(y)
    p = -np.linalg.solve(W, np.array(F))
    before, after = system.motion(y[:12]), system.motion(stuck.state[:12])
    assert stuck.axes == tuple(axis for axis in range(3) if not held[axis])
    assert sides_and_holds(stuck.system) == ([0, 0, 0], [1, 1, 1])
    assert after.Omega - before.Omega == pytest.approx(turn @ p, rel=1e-12)
    gained = after.V - before.V
    assert gained == pytest.approx(p / system.body.mass, rel=1e-12)
    assert after.Theta.tolist() == before.Theta.tolist()
    assert (stuck.state[6:12] == 0).all()
    assert stuck.state[12:].tolist() == y[12:].tolist()
    assert stuck.discarded == pytest.approx(-0.5 * p @ np.array(F), rel=1e-9)


def test_the_energy_of_the_chatter_is_that_of_the_velocity_and_of_the_displacement():
    y = STATE.copy()
    y[6:9] = [1e-3, -2e-3, 3e-3]
    chatter = Chatter(bound_by([1000, 2000, 3000]).system)
    W, _ = mobility(y)
    F = y[9:12]
    expected = float(0.5 * F @ np.linalg.solve(W, F)) + 1 + 4 + 9
    assert chatter.energy(y) == pytest.approx(expected, rel=1e-13)
    assert chatter.is_below(1.001 * expected, y)
    assert not chatter.is_below(0.999 * expected, y)


@pytest.mark.parametrize("weak", range(3))
def test_every_held_axis_has_to_bear_its_force(weak):
    """An axis with a bound a little below its force after the impulse does not stick with the rest.

    The other two may then stick without it, or not.
    """
    stuck = stick_of(bound_by([1e6, 1e6, 1e6]), STATE)
    force = np.abs(stuck.system.observe(stuck.state[:12]).contact_force)
    for share, allowed in ((1.0001, True), (0.9999, False)):
        bounds = np.full(3, 1e6)
        bounds[weak] = share * force[weak]
        weaker = stick_of(bound_by(bounds), STATE)
        assert (weaker is not None and weaker.axes == (0, 1, 2)) == allowed
        if weaker is not None and not allowed:
            assert weak not in weaker.axes or len(weaker.axes) < 3


@pytest.mark.parametrize("held", range(3))
def test_an_axis_that_is_held_must_bear_what_others_put_on_it(held):
    """Its bound lies between its force alone and its force with all three axes held."""
    holds = [float(axis == held) for axis in range(3)]
    y = at(np.where(np.arange(3) == held, 0.0, STATE[9:12]))
    all_stuck = stick_of(bound_by([1e6, 1e6, 1e6]), y, holds)
    needed = np.abs(all_stuck.system.observe(all_stuck.state[:12]).contact_force)
    bounds = np.full(3, 1e6)
    bounds[held] = 0.999 * needed[held]
    stuck = stick_of(bound_by(bounds), y, holds)
    assert stuck is None or len(stuck.axes) < 2


@each_engine
def test_a_point_at_rest_on_its_anchor_stays_there(engine):
    """A ball starts on the surface with E = F = 0, under loads within the connector's bounds."""
    still = np.zeros(3)
    problem = pushed_ball(
        2.0, np.full(3, 30.0), [5.0, 0.0, -5.0], np.zeros((3, 3)), still, still, [0.0, 0.1, 0.2],
        stick_energy=1.0, switch_limit=100,
    )  # fmt: skip
    run = solve_sliding(engine, problem)
    assert run.status is RunStatus.COMPLETED
    assert np.abs(run.states[:, 6:12]).max() < 1e-12
    assert run.switches.modes[-1].tolist() == [0, 0, 0]


@each_engine
def test_a_point_at_rest_that_cannot_be_held_leaves_at_once(engine):
    """Two loads exceed K = 30 N: on these axes x = ½ (load ∓ K) t² / m."""
    still, times = np.zeros(3), np.array([0.0, 0.1, 0.2])
    problem = pushed_ball(
        2.0, np.full(3, 30.0), [40.0, 10.0, -50.0], np.zeros((3, 3)), still, still, times
    )
    run = solve_sliding(engine, problem)
    assert run.status is RunStatus.COMPLETED
    pull = np.array([10.0, 0.0, -20.0]) / 2.0
    assert run.states[:, 6:9] == pytest.approx(0.5 * np.outer(times**2, pull), abs=1e-11)
    assert run.switches.modes[-1].tolist() == [1, 0, -1]
