"""Switches of both engines are those of closed forms, in time and in state.

θ2 alone turns about a principal axis between two guards: it flies straight, bounces from a spring
in the time π/ω, and from a constant couple along a parabola. A mass alone bounces between two
ligaments: the time in the toe is a quadrature, beyond it the mass is an oscillator.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.switching import (
    ENGINES,
    INERTIA,
    TIGHT,
    data,
    guard,
    ligament,
    problem,
    solved,
    toe_bounce,
)

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.engines import engine
from rbstab.integrate.heyoka.run import HeyokaRun
from rbstab.integrate.scipy_engine import ScipyRun
from rbstab.integrate.switching.driver import Driver
from rbstab.systems.modes import modes_of

RUNS: dict[str, Any] = {"scipy": ScipyRun, "heyoka": HeyokaRun}

SPIN, SOFT, K = 1.3, 0.3, 40.0

EACH = pytest.mark.parametrize("engine_name", ENGINES)


def switch_times(config, engine_name):
    """Return the times and the number of the modes at the switches of a run."""
    switches: list[tuple[float, list[int]]] = []
    kind: Any = RUNS[engine_name]

    class Recording(Driver):
        def cross(self, modes, t, y):
            switches.append((t, modes))
            return super().cross(modes, t, y)

        def cross_alone(self, mode, t):
            switches.append((t, [mode]))
            super().cross_alone(mode, t)

    settings = config["integration"] | TIGHT[engine_name] | {"engine": engine_name}
    changed = config | {"integration": settings}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rbstab.integrate.driven_run.Driver", Recording)
        trajectory = kind(problem(changed), None, Deadline(60.0)).result()
    assert trajectory.status == "completed"
    return switches


def turning(guard_method, size, **integration):
    start = {"angular_velocity": [0, SPIN, 0]}
    return data({"soft": guard(guard_method, size, SOFT)}, start, integration)


def angle_at(t):
    """Return θ2 between two springs, and its rate."""
    w = np.sqrt(K / INERTIA)
    flight, inside = 2 * SOFT / SPIN, np.pi / w
    number, phase = divmod(t + SOFT / SPIN, flight + inside)
    side = 1 if number % 2 == 0 else -1
    if phase < flight:
        return side * (SPIN * phase - SOFT), side * SPIN
    phase = w * (phase - flight)
    return side * (SOFT + SPIN / w * np.sin(phase)), side * SPIN * np.cos(phase)


@EACH
def test_the_state_is_that_of_the_closed_form_at_each_sample(engine_name):
    trajectory = solved(turning("stiff", K, duration=20.0), engine_name)
    expected = np.array([angle_at(t) for t in trajectory.times])
    np.testing.assert_allclose(trajectory.states[:, [1, 4]], expected, rtol=0, atol=1e-11)
    others = np.delete(trajectory.states, [1, 4], axis=1)
    np.testing.assert_allclose(others, 0, atol=1e-13)
    # The system of a sample is in the modes of its angle.
    for (angle, _), system in zip(expected, trajectory.systems, strict=True):
        (modes,) = [element.mode for element in system.elements if element.name == "soft"]
        assert modes.tolist() == [angle > SOFT, -angle > SOFT]


@EACH
def test_a_mass_bounces_between_two_ligaments(engine_name):
    speed, k, toe = 1.1, 80.0, 0.05
    elements = {"a": ligament(1.0), "b": ligament(-1.0)}
    config = data(elements, {"velocity": [speed, 0, 0]}, {"duration": 8.0, "samples": 3})
    switches = switch_times(config, engine_name)
    leaves, enters, free = toe_bounce(speed, k, 1.0, toe)
    offsets = np.array([0.0, leaves, enters, free])
    period = free + 2 * 0.3 / speed
    expected = (0.3 / speed + offsets + period * np.arange(20)[:, np.newaxis]).ravel()
    expected = expected[expected < 8.0]
    assert len(switches) == len(expected) > 20
    np.testing.assert_allclose([t for t, _ in switches], expected, rtol=0, atol=1e-11)
    # Moving to positive x, the ligament with its anchor at negative x goes taut (modes 2 and 3).
    cycle = [[2], [3], [3], [2], [0], [1], [1], [0]]
    assert [modes for _, modes in switches] == [cycle[i % 8] for i in range(len(switches))]


@pytest.mark.parametrize("method", ["DOP853", "RK45", "Radau"])
def test_order_of_the_method_holds_through_switches(method):
    """The error falls with the tolerance as it does without switches, over many of them."""
    config = turning("stiff", K, duration=6.0, samples=13)
    tolerances = [1e-5, 1e-7, 1e-9]
    errors = []
    for rtol in tolerances:
        trajectory = solved(config, "scipy", rtol=rtol, atol=rtol, method=method)
        expected = np.array([angle_at(t)[0] for t in trajectory.times])
        errors.append(np.abs(trajectory.states[:, 1] - expected).max())
    assert (np.array(errors) < 3e3 * np.array(tolerances)).all()
    assert errors[2] < 0.1 * errors[1] < 0.01 * errors[0]


@pytest.mark.parametrize("method", ["DOP853", "RK45", "Radau"])
def test_a_step_ends_exactly_on_a_switch_at_any_tolerance(method):
    """Dense output would be too inaccurate: the margin is zero up to round-off at each switch."""
    margins = []

    class Recording(ScipyRun):
        def _step_to(self, event):
            super()._step_to(event)
            margins.append(self.phase.margins(self.y, self.t)[event.number])

    settings = {"rtol": 1e-4, "atol": 1e-4, "method": method, "duration": 5.0}
    given = problem(turning("stiff", K, **settings))
    assert Recording(given, None, Deadline(60.0)).result().status == "completed"
    assert len(margins) > 5
    assert np.abs(margins).max() < 1e-14


@EACH
@pytest.mark.parametrize("angle", [-0.2, 0.5, -0.5])
def test_modes_are_those_of_the_start_of_a_problem_not_of_its_system(engine_name, angle):
    """A search for peaks starts a motion again at another state of the same system."""
    given = problem(turning("stiff", K, duration=0.5, samples=6, engine=engine_name))
    assert modes_of(given.system) == (0, 0)
    start = given.start.copy()
    start[[1, 4]] = angle, 0.0
    trajectory = engine(engine_name)(replace(given, start=start, rtol=1e-13), None, None)
    inside = max(abs(angle) - SOFT, 0.0)
    expected = np.sign(angle) * (SOFT + inside * np.cos(np.sqrt(K / INERTIA) * trajectory.times))
    if inside == 0:
        expected = angle
    beyond = trajectory.times < 0.5 * np.pi * np.sqrt(INERTIA / K)
    np.testing.assert_allclose((trajectory.states[:, 1] - expected)[beyond], 0, atol=1e-11)
    assert modes_of(trajectory.systems[0]) == (float(angle > SOFT), float(angle < -SOFT))
