"""Protects derivatives across switches, impacts and breakpoints against closed solutions."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from support.stops import stop
from support.switching import MASS, data

import rbstab
from rbstab.config.build import input_legs
from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError, sensitivities
from rbstab.experiment.tuning.tune import tune

pytest.importorskip("heyoka")

H = 1e-100


def derivatives(config, keys, *names):
    """Return the derivatives of some quantities by some numbers of a config."""
    effects = sensitivities(config)
    rows = [[entry.key for entry in effects.entries].index(key) for key in keys]
    return effects.derivatives[np.ix_(rows, [effects.column(name) for name in names])]


def of_formula(formula, numbers):
    """Return the derivatives of a formula by its numbers, from complex steps."""
    steps = np.array(numbers) + 1j * H * np.eye(len(numbers))
    return np.array([np.imag(formula(*row)) / H for row in steps])


STOP_KEYS = (
    "elements.it.angle",
    "elements.it.restitution",
    "initial.orientation[1]",
    "initial.angular_velocity[1]",
)


def test_a_body_that_bounces_between_two_stops():
    """Without a couple θ2 has a constant rate between two impacts, and e times that after each."""
    end = 3.0

    def closed(angle, e, begin, rate):
        first = (angle - begin) / rate
        second = first + 2.0 * angle / (e * rate)
        return [-angle + e * e * rate * (end - second), e * e * rate]

    numbers = (0.4, 0.7, 0.1, 0.8)
    assert 0.0 < closed(*numbers)[0] + 0.4 < 0.8
    start = {"orientation": [0, 0.1, 0], "angular_velocity": [0, 0.8, 0]}
    config = data({"it": stop(angle=0.4, restitution=0.7)}, start, {"duration": end})
    computed = derivatives(config, STOP_KEYS, "final.orientation[1]", "final.angular_velocity[1]")
    np.testing.assert_allclose(computed, of_formula(closed, numbers), rtol=1e-11)


SLIDING = {
    "kind": "sliding",
    "point": [0, 0, 0],
    "anchor": [0, 0, 0],
    "K_s": [6.0, 6.0, 6.0],
    "surface": {"slope": 2.0},
}


def test_an_axis_that_arrives_at_its_surface_slides_there():
    """x falls to s = ẋ + κx = 0 under K_s, and then as e^(-κt)."""
    end, slope = 2.0, 2.0

    def closed(force, mass, begin):
        arrival = (np.sqrt(1.0 + 2.0 * slope**2 * begin * mass / force) - 1.0) / slope
        at = begin - force * arrival**2 / (2.0 * mass)
        left = at * np.exp(-slope * (end - arrival))
        return [left, -slope * left]

    config = data({"it": SLIDING}, {"position": [0.5, 0, 0]}, {"duration": end})
    keys = ("elements.it.K_s[0]", "body.mass", "initial.position[0]")
    computed = derivatives(config, keys, "final.position[0]", "final.velocity[0]")
    np.testing.assert_allclose(computed, of_formula(closed, (6.0, MASS, 0.5)), rtol=1e-11)


PULSE_KEYS = tuple(f"elements.it.{key}" for key in ("amplitude", "signal.start", "signal.duration"))


def pulse(force, begin, length):
    """Return a force along x that acts for a while."""
    return {
        "kind": "input",
        "quantity": "force",
        "point": [0, 0, 0],
        "direction": [1, 0, 0],
        "amplitude": force,
        "signal": {"kind": "pulse", "start": begin, "duration": length},
    }


def knocked(force, begin, length, stiffness, damping):
    """Return when an oscillator settles that was knocked at rest: v falls to 1/1000 of its largest.

    v is largest at the end of the pulse.
    """
    A = np.array([[0.0, 1.0], [-stiffness / MASS, -damping / MASS]])
    at_end = np.array([force / stiffness, 0.0]) - expm(A * length) @ [force / stiffness, 0.0]

    def excess(t):
        x, speed = expm(A * (t - begin - length)) @ at_end
        value = 0.5 * stiffness * x * x + 0.5 * MASS * speed * speed
        largest = 0.5 * stiffness * at_end[0] ** 2 + 0.5 * MASS * at_end[1] ** 2
        return value - 1e-3 * largest, -damping * speed * speed

    t = brentq(lambda t: np.real(excess(t)[0]), np.real(begin + length), 10.0, xtol=1e-13)
    for _ in range(3):
        # Newton's steps also converge in the imaginary part.
        value, rate = excess(t)
        t = t - value / rate
    return t


def test_a_knock_from_rest_settles():
    numbers = (30.0, 0.3, 0.05, 40.0, 4.0)
    knock = {"it": pulse(*numbers[:3])}
    config = data(knock, integration={"duration": 6.0}, controller=CONTROLLER)
    keys = (*PULSE_KEYS, "controller.K_t[0]", "controller.L_t[0]")
    effects = sensitivities(config)
    assert effects.values[effects.column("settling_time")] == pytest.approx(knocked(*numbers))
    given = derivatives(config, keys, "settling_time")[:, 0]
    np.testing.assert_allclose(given, of_formula(knocked, numbers), rtol=1e-8, atol=1e-10)


CONTROLLER = {"variant": "free", "K_t": [40, 50, 60], "L_t": [4, 5, 6]}
CONTROLLER |= {"K_r": [0.3, 0.4, 0.5], "L_r": [0.03, 0.05, 0.04]}


def test_shifted_legs_begin_with_those_of_the_run():
    """To the last digit, although k/rate has other digits for a complex rate."""
    from rbstab.experiment.tuning.sensitivities import shifted_along

    rate = 49.0
    signal = {"kind": "noise", "seed": 1, "rate": rate, "correlation_time": 0.2}
    push = {"kind": "input", "quantity": "couple", "direction": [1, 0, 0], "amplitude": 1.0}
    config = rbstab.load_config(data({"it": push | {"signal": signal}}))
    path = ("elements", "it", "signal", "rate")
    legs = shifted_along(config, [(path, rate)]).legs["it"]
    assert np.iscomplexobj(legs)
    np.testing.assert_array_equal(legs.real, input_legs(config)["it"])


AT_ONCE = SLIDING | {"surface": "position"}

SLIDING_CONTROLLER = CONTROLLER | {"variant": "sliding", "K_s": [9, 9, 9], "surface": "position"}

REFUSED = {
    "chaotic": (
        data(
            {"it": AT_ONCE | {"point": [0.3, 0.2, 0.1], "K_s": [90.0, 80.0, 70.0]}},
            {"position": [0.5, 0.4, 0.3], "angular_velocity": [1, 2, 3]},
            {"duration": 20.0},
        ),
        r"is 20 s, but the motion is chaotic\. .* \(expected a shorter run\)",
    ),
    "at once": (
        data({"it": AT_ONCE}, {"position": [0.5, 0.5, 0.3]}, {"duration": 3.0}),
        r"it: 2 switches come at once at t = 0\.577350269 s",
    ),
    "at its stop": (
        data({"it": stop(angle=0.4)}, {"orientation": [0, 0.4, 0]}),
        r"it: the body touches it at the start",
    ),
    "held on s = E": (
        data({}, {"angular_velocity": [0, 0.1, 0]}, controller=SLIDING_CONTROLLER),
        r"an axis is held on s = E from the start",
    ),
    "sticks": (
        data(
            {},
            {"position": [0.1, 0, 0]},
            controller=SLIDING_CONTROLLER | {"stick_energy": 0.5},
        ),
        r"controller\.stick_energy: is 0\.5 J",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_motion_without_derivatives_is_refused(name):
    config, message = REFUSED[name]
    with pytest.raises(UnsuitedConfigError, match=message):
        sensitivities(config)


def test_a_motion_past_the_pole_of_euler_angles_is_refused():
    """It is found in quaternions, and its derivatives are not."""
    gains = {"K_c": [9, 9, 9], "L_c": [1, 1, 1]}
    tie = {"kind": "visco-elastic", "point": [0, 0, 0.1], "anchor": [0, 0, 0], **gains}
    given = {
        "schema_version": 2,
        "body": {"mass": 2, "inertia": [0.06, 0.05, 0.03], "contact_point": [0, 0, -0.25]},
        "elements": {"tie": tie},
        "initial": {"angular_velocity": [0, 8, 0]},
        "integration": {"duration": 1},
    }
    assert rbstab.simulate(given).status == "completed"
    for refused in (sensitivities, lambda config: tune(config, "energy", ["elements.tie.L_c"])):
        with pytest.raises(UnsuitedConfigError, match="the motion passes θ2 = ±90°"):
            refused(given)
