"""A held axis is released when its force reaches its bound without a jump, at the known time.

One axis of a ball is held. A second one pushes it with -k x, and moves on a parabola because its
own load exceeds the connector. So the force on the first axis is a polynomial in time (plus the
exponential of a slide), and so is its motion after the release.
"""

from itertools import product

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.optimize import brentq
from support.sliding import pushed_ball, solve_sliding

from rbstab.integrate.switching import connector_switches

M, K, LOAD, STIFFNESS = 2.0, 30.0, 4.0, 25.0
RAMP = Polynomial([0.2, 0.4, 2.5])
"""x of the axis that pushes; its load exceeds the connector by 5 m/s²."""

TIMES = np.linspace(0, 1, 41)
CASES = [*product(["heyoka"], range(3), [1.0, -1.0]), ("scipy", 1, 1.0), ("scipy", 2, -1.0)]


def pushed(axis, sign, x, v, slope=None):
    """Return a ball whose `axis` starts at x and v; the next axis pushes it."""
    pusher = (axis + 1) % 3
    K_s, load, X, V = np.full(3, 20.0), np.full(3, 30.0), np.ones(3), np.zeros(3)
    K_s[axis], load[axis], X[axis], V[axis] = K, LOAD, x, v
    X[pusher], V[pusher] = RAMP.coef[:2]
    coupling = np.zeros((3, 3))
    coupling[axis, pusher] = sign * STIFFNESS
    return pushed_ball(M, K_s, load, coupling, X, V, TIMES, slope, stick_energy=1e3)


def acceleration(force, sign):
    """Return ẍ of the pushed axis under a constant contact force, a polynomial in time."""
    return (force + LOAD - sign * STIFFNESS * RAMP) / M


def kinds(run, axis):
    return [(str(kind), which == axis) for _, which, kind in run.switches.transitions]


@pytest.mark.parametrize(("engine", "axis", "sign"), CASES)
def test_off_the_position(engine, axis, sign):
    """Λ = ±kx - load holds E = 0 until it is ±K; from then on Λ = ±K and ẍ ~ -(t - release).

    The net force grows from zero at the release, so x leaves as the third power of time.
    """
    run = solve_sliding(engine, pushed(axis, sign, 1e-3, -0.1))
    release = brentq(sign * STIFFNESS * RAMP - LOAD - sign * K, 0, 1)
    assert kinds(run, axis) == [("stick", True), ("release", True)]
    assert run.switches.transitions[1][0] == pytest.approx(release, abs=1e-12)
    path = acceleration(sign * K, sign).integ(2, lbnd=release)
    after = run.times > release
    assert 10 < after.sum() < 30
    assert run.states[after, 6 + axis] == pytest.approx(path(run.times[after]), abs=1e-12)
    # The force -K_s σ stays at the bound that it reached, and the axis leaves against it.
    assert (run.switches.modes[after, axis] == -sign).all()
    assert (run.states[after, 6 + axis] * sign < 0).all()
    assert run.switches.counts[-1, axis] == 3


@pytest.mark.parametrize(("engine", "axis", "sign"), CASES)
def test_off_a_slope(engine, axis, sign):
    """While the axis slides on s = F + κE = 0, E = E₀exp(-κt) and Λ = κ²mE ± kx - load."""
    slope, x, v = 4.0, -0.3, 0.7
    run = solve_sliding(engine, pushed(axis, sign, x, v, slope))
    # At first s < 0, so Λ = K until s = 0.
    velocity = acceleration(K, sign).integ(1, k=v)
    path = velocity.integ(1, k=x)
    arrival = brentq(velocity + slope * path, 0, 0.1)

    def displacement(t):
        return path(arrival) * np.exp(-slope * (t - arrival))

    def excess(t):
        force = slope**2 * M * displacement(t) + sign * STIFFNESS * RAMP(t) - LOAD
        return force - sign * K

    release = brentq(excess, arrival, 1, xtol=1e-15)
    assert kinds(run, axis) == [("stick", True), ("release", True)]
    transition_times = [time for time, _, _ in run.switches.transitions]
    assert transition_times == pytest.approx([arrival, release], abs=1e-12)
    left = acceleration(sign * K, sign).integ(1, lbnd=release, k=-slope * displacement(release))
    left = left.integ(1, lbnd=release, k=displacement(release))
    sliding = (run.times > arrival) & (run.times < release)
    after = run.times > release
    assert sliding.sum() > 5
    assert after.sum() > 5
    E = run.states[:, 6 + axis]
    assert E[sliding] == pytest.approx(displacement(run.times[sliding]), abs=1e-12)
    assert E[after] == pytest.approx(left(run.times[after]), abs=1e-12)
    assert (run.switches.modes[after, axis] == -sign).all()


@pytest.mark.parametrize("slope", [None, 4.0])
def test_a_release_is_no_occasion_to_stick_again(monkeypatch, slope):
    """The force is at its bound up to round-off: a check there would hold the axis again."""
    monkeypatch.setattr(connector_switches, "MIN_STICK_TEST_INTERVAL", 0)
    monkeypatch.setattr(connector_switches, "STICK_TEST_DIVISOR", 10**9)
    for sign in (1.0, -1.0):
        start = (1e-3, -0.1) if slope is None else (-0.3, 0.7)
        run = solve_sliding("heyoka", pushed(0, sign, *start, slope))
        assert [kind for kind, _ in kinds(run, 0)] == ["stick", "release"]
