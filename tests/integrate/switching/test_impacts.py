"""Protects impacts against a stop, on both engines, by closed forms.

A body that turns about a principal axis flies from stop to stop: its rate falls by e at each. Under
a constant couple it hops like a ball, infinitely often in a finite time, and then rests.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.stops import (
    ANGLE,
    couple_of,
    pressed,
    residual,
    solution,
    stop,
    stopped,
)
from support.switching import ENGINES, INERTIA, data, ligament, problem, solved

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.scipy_engine import ScipyRun
from rbstab.integrate.switching import driver
from rbstab.systems.impact import HOP_HEIGHT

EACH = pytest.mark.parametrize("engine_name", ENGINES)
SPIN, COUPLE = 1.3, 3.0
PRESS = COUPLE / INERTIA
"""rad/s²: the acceleration of the free body towards its stop."""


@EACH
@pytest.mark.parametrize("restitution", [1.0, 0.7])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_body_bounces_between_its_stops(engine_name, restitution, side):
    trajectory = solved(stopped(restitution, side * SPIN, duration=14.9, samples=301), engine_name)
    impacts = trajectory.impacts
    assert trajectory.status == "completed"
    count = len(impacts.times)
    rates = side * SPIN * (-restitution) ** np.arange(count)
    flights = 2 * ANGLE / np.abs(rates[1:])
    times = np.cumsum([ANGLE / SPIN, *flights])
    assert 6 < count < len(times) + 1
    np.testing.assert_allclose(impacts.times, times, rtol=0, atol=1e-12)
    np.testing.assert_allclose(impacts.rates, rates, rtol=0, atol=1e-12)
    assert times[-1] + 2 * ANGLE / (restitution * abs(rates[-1])) > 14.9
    # The state, the counts and the losses at each sample.
    flight = np.searchsorted(times, trajectory.times, side="right")
    speed = side * SPIN * (-restitution) ** flight
    begin = np.concatenate([[0.0], times])[flight]
    place = np.where(flight > 0, -np.sign(speed) * ANGLE, 0.0)
    np.testing.assert_allclose(trajectory.states[:, 4], speed, atol=1e-12)
    np.testing.assert_allclose(
        trajectory.states[:, 1], place + speed * (trajectory.times - begin), atol=1e-11
    )
    assert impacts.counts.tolist() == flight.tolist()
    lost = 0.5 * INERTIA * SPIN**2 * (1 - restitution ** (2 * flight))
    np.testing.assert_allclose(impacts.lost, lost, atol=1e-13)
    assert not impacts.resting.any()
    assert not impacts.rests


def hopping(restitution, spin=1.0, **integration):
    """Return a body that leaves its stop with a rate, under a couple towards it."""
    start = {"orientation": [0, ANGLE, 0], "angular_velocity": [0, -spin, 0]}
    return data({"end": stop(restitution)}, start, {"duration": 6.0} | integration)


@EACH
@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8])
def test_hops_end_in_a_rest_at_the_time_of_the_closed_form(engine_name, restitution):
    """The flights last 2v/a, 2ev/a, ...; all of them 2v/(a(1 - e))."""
    trajectory = solution(pressed(hopping(restitution), engine_name, COUPLE), engine_name)
    assert trajectory.status == "completed"
    impacts, end = trajectory.impacts, 2.0 / (PRESS * (1 - restitution))
    count = len(impacts.times)
    flights = 2.0 / PRESS * restitution ** np.arange(count)
    np.testing.assert_allclose(impacts.times, np.cumsum(flights), atol=2e-8)
    # It rests from the first impact after which the hops are too low; what is left is known.
    ((begin, until),) = impacts.rests
    assert begin == impacts.times[-1]
    assert np.isnan(until)
    heights = (restitution ** np.arange(1, count + 1)) ** 2 / (2 * PRESS)
    assert heights[-1] <= HOP_HEIGHT
    assert (heights[:-1] > HOP_HEIGHT).all()
    left = 2 * restitution**count / (PRESS * (1 - restitution))
    assert abs(end - begin - left) < 1e-7
    # All of the kinetic energy is lost, at most the couple times the height by the end.
    assert abs(impacts.lost[-1] - 0.5 * INERTIA) < 1e-11
    resting = trajectory.times > end
    assert resting.any()
    assert (trajectory.states[resting, 1] == ANGLE).all()
    assert np.abs(trajectory.states[resting, 4]).max() < 1e-15
    assert impacts.resting.tolist() == resting.astype(int).tolist()
    assert abs(couple_of(trajectory.systems[-1], trajectory.states[-1]) + COUPLE) < 1e-12
    assert residual(trajectory) < 1e-11


@EACH
def test_what_coming_to_rest_discards_is_in_the_balance(engine_name):
    """Under a large load the last hop, of up to 1e-12 rad, still holds 1e-8 J."""
    config = hopping(0.5, duration=1e-3)
    trajectory = solution(pressed(config, engine_name, 3e4), engine_name)
    assert trajectory.impacts.resting[-1] == 1
    in_hops = 0.5 * INERTIA * (1 - 0.25 ** len(trajectory.impacts.times))
    assert 1e-9 < trajectory.impacts.lost[-1] - in_hops < 3e4 * HOP_HEIGHT
    assert residual(trajectory) < 1e-10


@EACH
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_start_into_the_stop_is_an_impact_at_once(engine_name, restitution):
    start = {"orientation": [0, -ANGLE, 0], "angular_velocity": [0, -1.0, 0]}
    config = data({"end": stop(restitution)}, start, {"duration": 0.3})
    trajectory = solved(config, engine_name)
    assert trajectory.impacts.times.tolist() == [0.0]
    assert trajectory.impacts.rates.tolist() == [-1.0]
    # The first sample is the start; the impact follows it.
    assert (trajectory.impacts.counts[:2] == [0, 1]).all()
    assert trajectory.states[0, 4] == -1.0
    np.testing.assert_allclose(trajectory.states[1:, 4], restitution, atol=1e-15)


@pytest.mark.parametrize("method", ["DOP853", "RK45", "Radau"])
def test_order_of_the_method_holds_through_impacts(method):
    """Θ2 under an attitude spring follows its quadrature; the error falls as the tolerance."""
    spring = {"kind": "attitude", "K": [8.0] * 3, "L": [1e-30] * 3}
    start = {"angular_velocity": [0, SPIN, 0]}
    config = data({"end": stop(0.8), "turn": spring}, start, {"duration": 3.0, "samples": 2})
    exact = solved(config, "heyoka").states[-1, 1]
    errors = []
    tolerances = [1e-5, 1e-7, 1e-9]
    for rtol in tolerances:
        trajectory = solved(config, "scipy", rtol=rtol, atol=rtol, method=method)
        assert len(trajectory.impacts.times) == 4
        errors.append(abs(trajectory.states[-1, 1] - exact))
    assert (np.array(errors) < 1e3 * np.array(tolerances)).all()
    assert errors[2] < 0.1 * errors[1] < 0.01 * errors[0]


@EACH
def test_ligaments_that_go_taut_at_the_impact(engine_name):
    """At one instant θ2 meets its stop and the mass its ligament: both follow their closed forms.

    Neither feels the other: the body is a sphere, and the ligament pulls at its centre.
    """
    start = {"velocity": [1.0, 0, 0], "angular_velocity": [0, 1.0, 0]}
    config = data({"a": ligament(-1.0), "end": stop(0.5)}, start, {"duration": 0.5, "samples": 26})
    together = solved(config, engine_name)
    alone = solved(config | {"elements": {"a": ligament(-1.0)}}, engine_name)
    assert together.impacts.times == pytest.approx([0.3], abs=1e-14)
    np.testing.assert_allclose(together.states[:, 6:], alone.states[:, 6:], atol=1e-12)
    assert together.states[-1, 6] < 0.49
    t = together.times
    expected = np.where(t < 0.3, t, 0.45 - 0.5 * t)
    np.testing.assert_allclose(together.states[:, 1], expected, atol=1e-12)


@EACH
def test_a_guard_that_the_impact_turns_back_does_not_switch(engine_name):
    """θ2 reaches the stop and the end of a ligament's slack together, and turns back from both."""
    # The ligament's point moves along x by 0.3 sin θ2, so it is at its slack length at the stop.
    reach = 0.3 * np.sin(ANGLE)
    line = ligament(point=[0, 0, 0.3], anchor=[reach - 1.0, 0, 0.3 * np.cos(ANGLE)])
    config = data(
        {"end": stop(0.5), "line": line},
        {"angular_velocity": [0, SPIN, 0]},
        {"duration": 0.6, "samples": 7},
    )
    trajectory = solved(config, engine_name)
    assert trajectory.status == "completed"
    bounce = ANGLE / SPIN
    after = ANGLE - 0.5 * SPIN * (trajectory.times - bounce)
    expected = np.where(trajectory.times < bounce, SPIN * trajectory.times, after)
    np.testing.assert_allclose(trajectory.states[:, 1], expected, atol=1e-11)


# --- Limits.


@EACH
def test_a_start_beyond_the_stop_ends_the_run(engine_name):
    given = problem(stopped(0.5, 1.0, engine=engine_name))
    start = given.start.copy()
    start[1] = ANGLE + 1e-6
    trajectory = solution(replace(given, start=start), engine_name)
    assert trajectory.status == "solver failure"
    assert trajectory.detail == "θ2 starts beyond the stop end at t = 0 s"
    assert len(trajectory.impacts.counts) == 1


@EACH
def test_limit_of_impacts(engine_name, monkeypatch):
    """The run ends before the impact that is one too many; the audit balances."""
    monkeypatch.setattr(driver, "IMPACT_LIMIT", 4)
    trajectory = solved(stopped(0.9, SPIN), engine_name)
    assert trajectory.status == "switch limit"
    assert trajectory.detail.startswith("stopped after 4 impacts at t = ")
    assert trajectory.impacts.counts[-1] == 4
    assert trajectory.times[-1] > trajectory.impacts.times[-1]
    assert residual(trajectory) < 1e-13


def test_time_limit_in_hops():
    ticks = iter(range(10**6))
    given = pressed(hopping(0.95), "scipy", COUPLE)
    deadline = Deadline(700.0, clock=lambda: float(next(ticks)))
    trajectory: Any = ScipyRun(given, None, deadline).result()
    assert trajectory.status == "time limit"
    assert len(trajectory.impacts.counts) == len(trajectory.times) == len(trajectory.systems)
    assert residual(trajectory) < 1e-11
