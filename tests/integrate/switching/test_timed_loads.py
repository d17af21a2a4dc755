"""Protects loads that depend on the time: on a body at its stop, and on axes that slide.

Expected values are closed forms: parabolas and sines of a mass or of a body that turns about one
axis. A rest ends where the load turns, an axis is released where the load exceeds its force; both
can happen at a breakpoint, exactly.
"""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from support.stops import ANGLE, couple_of, stop
from support.switching import ENGINES, INERTIA, MASS, data, solved

from rbstab.systems.modes import modes_of

EACH = pytest.mark.parametrize("engine_name", ENGINES)

REST: dict[str, Any] = {"orientation": [0.0, ANGLE, 0.0]}


def turning(signal, amplitude):
    """Return a couple about the axis of θ2 of a body that turns about this axis alone."""
    return {
        "kind": "input",
        "quantity": "couple",
        "direction": [0, 1, 0],
        "amplitude": amplitude,
        "signal": signal,
    }


def pushing(signal, amplitude):
    """Return a force along x at the centre of gravity."""
    ends = {"quantity": "force", "point": [0, 0, 0], "direction": [1, 0, 0]}
    return {"kind": "input", **ends, "amplitude": amplitude, "signal": signal}


# A stop.

COUPLE, FREQUENCY, PHASE = 0.6, 0.25, 0.7
OMEGA = 2 * np.pi * FREQUENCY


def swung(t, begin):
    """Return θ2 - θ_e of a body that leaves its stop at a time, under the sine."""
    angle, first = OMEGA * t + PHASE, OMEGA * begin + PHASE
    turned = np.cos(first) * (angle - first) - np.sin(angle) + np.sin(first)
    return float(COUPLE / INERTIA / OMEGA**2 * turned)


@EACH
def test_a_rest_ends_where_a_sine_turns(engine_name):
    """It is released where sin(ωt + φ) = 0, and meets the other side after ∬ sin."""
    sine = {"kind": "sine", "frequency": FREQUENCY, "phase": PHASE}
    config = data({"end": stop(), "push": turning(sine, COUPLE)}, REST, {"duration": 4.0})
    trajectory = solved(config, engine_name)
    assert trajectory.status == "completed"
    released = (np.pi - PHASE) / OMEGA
    (rest,) = trajectory.impacts.rests
    assert rest == (0.0, pytest.approx(released, abs=1e-13))
    met = brentq(lambda t: swung(t, released) + 2 * ANGLE, released + 0.1, 4.0, xtol=1e-15)
    assert trajectory.impacts.times[0] == pytest.approx(met, abs=1e-12)
    flying = (trajectory.times > released) & (trajectory.times < met)
    expected = [ANGLE + swung(t, released) for t in trajectory.times[flying]]
    assert flying.sum() > 40
    np.testing.assert_allclose(trajectory.states[flying, 1], expected, rtol=0, atol=1e-12)
    # While it rests, the couple of the stop is minus the load.
    resting = trajectory.times < released
    for t, system, y in zip(
        trajectory.times[resting], trajectory.systems, trajectory.states, strict=False
    ):
        motion, pairs = system.acting(y, t)
        torque = sum(element.wrench(motion, states).couple for element, states in pairs)
        assert abs(torque[1]) < 1e-14


BEGIN, BACK = 1.0, 1.4
TABLE = {
    "kind": "table",
    "times": [0.0, BEGIN, BEGIN, BACK, BACK],
    "values": [1.0, 1.0, -1.0, -1.0, 1.0],
}


@EACH
def test_a_rest_ends_at_a_breakpoint_and_begins_again(engine_name):
    """A couple turns away from the stop for 0.4 s. The body flies out, back, and hops to a rest."""
    restitution = 0.5
    config = data(
        {"end": stop(restitution), "push": turning(TABLE, COUPLE)},
        REST,
        {"duration": 5.0, "samples": 51},
    )
    trajectory = solved(config, engine_name)
    assert trajectory.status == "completed"
    a, away = COUPLE / INERTIA, BACK - BEGIN
    first, second = trajectory.impacts.rests
    assert first == (0.0, BEGIN)
    # The depth doubles while the couple brakes; then it falls back as far.
    met, speed = BACK + away + np.sqrt(2) * away, a * away * np.sqrt(2)
    assert trajectory.impacts.times[0] == pytest.approx(met, abs=1e-12)
    assert trajectory.impacts.rates[0] == pytest.approx(speed, abs=1e-12)
    hops = 2 * speed / a * restitution ** np.arange(1, 11)
    np.testing.assert_allclose(trajectory.impacts.times[1:11], met + np.cumsum(hops), atol=1e-11)
    # The last hops are shorter than 3e-6 s.
    assert second[0] == pytest.approx(met + 2 * speed / a, abs=1e-5)
    assert np.isnan(second[1])
    assert trajectory.impacts.lost[-1] == pytest.approx(0.5 * INERTIA * speed**2, abs=1e-11)
    # The sample at the breakpoint is that of the leg which begins there: the body does not rest.
    row = int(np.flatnonzero(trajectory.times == BEGIN)[0])
    assert trajectory.impacts.resting[row - 1 : row + 1].tolist() == [1, 0]
    # ∫ M dθ2: out and back under -M, and then M.
    supplied = COUPLE * a * away**2 / 2
    assert trajectory.supplied_energy[-1] == pytest.approx(2 * supplied, abs=1e-12)
    assert couple_of(trajectory.systems[0], trajectory.states[0]) == pytest.approx(
        -COUPLE, abs=1e-14
    )


# Sliding ties.

FORCE, SLOPE, E_0 = 20.0, 2.0, 0.5
"""K_s, N; κ, 1/s; E at the start, m, where s = 0."""

HELD = MASS * SLOPE**2
"""mκ²: the force that E = 1 m needs on the surface, N."""


def sliding(signal, amplitude, **integration):
    """Return a mass that starts on the surface of a tie, with a force from outside."""
    ends = {"point": [0.0] * 3, "anchor": [0.0] * 3}
    tie = {"kind": "sliding", **ends, "K_s": [FORCE] * 3, "surface": {"slope": SLOPE}}
    start = {"position": [E_0, 0, 0], "velocity": [-SLOPE * E_0, 0, 0]}
    return data({"tie": tie, "push": pushing(signal, amplitude)}, start, integration)


@EACH
def test_an_axis_is_released_where_a_sine_exceeds_its_force(engine_name):
    """Λ = mκ²E - a sin ωt reaches -K_s; then the mass is pushed by a sin ωt - K_s."""
    a, omega = 45.0, 2 * np.pi * 0.5
    signal = {"kind": "sine", "frequency": 0.5}
    trajectory = solved(sliding(signal, a, duration=0.45, samples=91), engine_name)
    assert trajectory.status == "completed"

    def force(t):
        return HELD * E_0 * np.exp(-SLOPE * t) - a * np.sin(omega * t)

    released = brentq(lambda t: force(t) + FORCE, 0.0, 0.45, xtol=1e-16)
    x, v = E_0 * np.exp(-SLOPE * released), -SLOPE * E_0 * np.exp(-SLOPE * released)
    t = trajectory.times
    tau = t - released
    swing = (np.sin(omega * released) - np.sin(omega * t)) / omega + tau * np.cos(omega * released)
    free = x + v * tau + (a / omega * swing - 0.5 * FORCE * tau**2) / MASS
    expected = np.where(t < released, E_0 * np.exp(-SLOPE * t), free)
    np.testing.assert_allclose(trajectory.states[:, 6], expected, rtol=0, atol=1e-12)
    held = np.array([modes_of(system)[-3] for system in trajectory.systems])
    np.testing.assert_array_equal(held, t < released)
    for system, y, time in zip(trajectory.systems, trajectory.states, t.tolist(), strict=True):
        _, pairs = system.acting(y, time)
        (forces,) = [forces for element, forces in pairs if element.slides]
        if time < released:
            assert forces[0] == pytest.approx(force(time), abs=1e-9)


@EACH
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_axis_is_released_at_a_breakpoint_and_slides_again(engine_name, sign):
    """The force jumps beyond K_s for 0.2 s; the mass leaves its surface at once, and comes back."""
    begin, away, a = 0.5, 0.2, 60.0 * sign
    pulse = {"kind": "pulse", "start": begin, "duration": away}
    trajectory = solved(sliding(pulse, a, duration=3.0, samples=61), engine_name)
    assert trajectory.status == "completed"
    x, v, t = E_0 * np.exp(-SLOPE * begin), -SLOPE * E_0 * np.exp(-SLOPE * begin), trajectory.times
    expected = E_0 * np.exp(-SLOPE * t)
    out, back = (a - sign * FORCE) / MASS, -sign * FORCE / MASS
    flying = (t >= begin) & (t < begin + away)
    expected[flying] = x + v * (t[flying] - begin) + out / 2 * (t[flying] - begin) ** 2
    x, v = x + v * away + out / 2 * away**2, v + out * away
    # s = F + κE is quadratic in time until it is zero again.
    roots = np.roots([SLOPE * back / 2, back + SLOPE * v, v + SLOPE * x])
    flight = min(root.real for root in roots if root.real > 0)
    tau = t - begin - away
    braked = (tau >= 0) & (tau < flight)
    expected[braked] = x + v * tau[braked] + back / 2 * tau[braked] ** 2
    arrived = x + v * flight + back / 2 * flight**2
    expected[tau >= flight] = arrived * np.exp(-SLOPE * (tau[tau >= flight] - flight))
    np.testing.assert_allclose(trajectory.states[:, 6], expected, rtol=0, atol=1e-12)
    held = np.array([modes_of(system)[-3] for system in trajectory.systems])
    np.testing.assert_array_equal(held, (t < begin) | (tau >= flight))
    assert braked.sum() > 3
