"""Limits stop a run with switches, with their status and with what was computed until then."""

from typing import Any

import numpy as np
import pytest
from support.switching import ENGINES, data, guard, ligament, problem, solved

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.run import HeyokaRun
from rbstab.integrate.scipy_engine import ScipyRun
from rbstab.integrate.switching import driver

EACH = pytest.mark.parametrize("engine_name", ENGINES)
RUNS: dict[str, Any] = {"scipy": ScipyRun, "heyoka": HeyokaRun}

BOUNCING = data(
    {"a": ligament(-1.0), "b": ligament(1.0)}, {"velocity": [1.1, 0, 0]}, {"samples": 11}
)


def whole(engine_name, **changes):
    return solved(BOUNCING, engine_name, rtol=1e-12, **changes)


def limited(monkeypatch, most, given, engine_name):
    """Return a run that stops after a number of switches."""
    monkeypatch.setattr(driver, "SWITCH_LIMIT", most)
    return RUNS[engine_name](given, None, Deadline(60.0)).result()


@EACH
def test_switch_limit(engine_name, monkeypatch):
    settings = BOUNCING["integration"] | {"engine": engine_name}
    given = problem(BOUNCING | {"integration": settings})
    trajectory = limited(monkeypatch, 5, given, engine_name)
    assert trajectory.status == "switch limit"
    stop = trajectory.times[-1]
    assert trajectory.detail == f"stopped after 5 switches at t = {stop:.9g} s"
    complete = whole(engine_name)
    shared = len(trajectory.times) - 1
    assert 0 < shared < 10
    np.testing.assert_allclose(trajectory.states[:shared], complete.states[:shared], atol=1e-10)


@EACH
def test_range_is_left_beyond_a_soft_guard(engine_name):
    """A weak guard switches, but does not hold the body: cos θ2 falls to its bound."""
    start = {"angular_velocity": [0, 3.0, 0]}
    config = data({"soft": guard("repelling", 1.0)}, start)
    trajectory = solved(config, engine_name)
    assert trajectory.status == "range left"
    assert abs(np.cos(trajectory.states[-1, 1]) - 1e-3) < 1e-12
    # θ̈2 = -K/J2 from the soft angle on.
    arrival, way, braking = 0.1, np.arccos(1e-3) - 0.3, 1.0 / 1.5
    passing = (3.0 - np.sqrt(9.0 - 2 * braking * way)) / braking
    assert abs(trajectory.times[-1] - arrival - passing) < 1e-11
    assert trajectory.systems[-1].elements[-1].mode.tolist() == [1.0, 0.0]


def pressed(engine_name, angle):
    """Return a body that a spring beside its centre of gravity turns towards larger θ2.

    Its repelling guard is stronger than the spring. A tie with dampers holds the body elsewhere.
    """
    spring = {"kind": "spring", "point": [0.5, 0.0, 0.0], "anchor": [0.5, 0.0, -3.0]}
    tie = {"kind": "visco-elastic", "point": [0, 0, 0], "anchor": [0, 0, 0]}
    elements = {
        "soft": guard("repelling", 50.0),
        "drive": spring | {"stiffness": 10.0, "rest_length": 1.0, "damping": 20.0},
        "hold": tie | {"K_c": [1e3] * 3, "L_c": [50] * 3},
    }
    settings = {"engine": engine_name, "duration": 60.0}
    return problem(data(elements, {"orientation": [0, angle, 0]}, settings))


@EACH
def test_a_load_that_presses_against_a_repelling_guard_ends_the_run(engine_name, monkeypatch):
    """The hops about the soft angle become infinitely many: no wrong motion, and no endless run."""
    trajectory = limited(monkeypatch, 2000, pressed(engine_name, 0.0), engine_name)
    assert trajectory.status in ("switch limit", "solver failure")
    assert abs(trajectory.states[-1, 1] - 0.3) < 1e-3
    assert trajectory.times[-1] > 0.1


@EACH
def test_a_start_at_rest_that_the_guard_holds_ends_at_once(engine_name, monkeypatch):
    """Neither mode leads away from the soft angle."""
    trajectory = limited(monkeypatch, 2000, pressed(engine_name, 0.3), engine_name)
    assert trajectory.status == "solver failure"
    assert trajectory.detail == "the motion stays where soft switches at t = 0 s"
