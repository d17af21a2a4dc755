"""Protects rests against a stop: the couple that holds, the release, the limit of stiff springs.

A rest is compared with a matrix exponential, with the static balance, and with a spring that is
stiff and one-sided: a stop without restitution loss is its limit.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.linalg import expm
from support.stops import ANGLE, couple_of, energies, residual, solution, stop
from support.switching import ENGINES, INERTIA, MASS, TIGHT, data, problem, solved

from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.elements.element import Element
from rbstab.mechanics.motion import Wrench
from rbstab.mechanics.numbers import Number
from rbstab.mechanics.states import PITCH

EACH = pytest.mark.parametrize("engine_name", ENGINES)

STIFFNESS, COUPLING, LOAD = 18.0, 4.0, 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Coupled(Element):
    """The energy ½ k x² - c x θ2 - C θ2: θ2 is pressed by C + c x, and x is pulled by c θ2."""

    name: str = "coupled"
    k: Number = STIFFNESS
    c: Number = COUPLING
    C: Number = LOAD

    def wrench(self, motion, states):
        x, pitch, zero = motion.X[0], motion.Theta[PITCH], 0.0 * motion.X[0]
        force = np.array([self.c * pitch - self.k * x, zero, zero])
        return Wrench(force, (self.C + self.c * x) * motion.B[PITCH], np.zeros(3))

    def stored(self, motion, states):
        x, pitch = motion.X[0], motion.Theta[PITCH]
        return 0.5 * self.k * x * x - self.c * x * pitch - self.C * pitch


def coupled(engine_name, x, restitution=0.5, **integration):
    """Return a problem that starts at rest on its stop, with the mass at x."""
    start = {"orientation": [0, ANGLE, 0], "position": [x, 0, 0]}
    settings = TIGHT[engine_name] | {"engine": engine_name} | integration
    given = problem(data({"end": stop(restitution)}, start, settings))
    elements = (*given.system.elements, Coupled())
    return replace(given, system=replace(given.system, elements=elements))


@EACH
def test_a_rest_ends_when_its_load_turns(engine_name):
    """x swings about c θ_e/k until C + c x = 0; then both coordinates are linear oscillators."""
    given = coupled(engine_name, 0.9, duration=1.5, samples=151)
    trajectory = solution(given, engine_name)
    assert trajectory.status == "completed"
    w, middle = np.sqrt(STIFFNESS / MASS), COUPLING * ANGLE / STIFFNESS
    release = np.arccos((-LOAD / COUPLING - middle) / (0.9 - middle)) / w
    ((begin, end),) = trajectory.impacts.rests
    assert begin == 0.0
    assert abs(end - release) < 1e-12
    t, resting = trajectory.times, trajectory.times < release
    assert trajectory.impacts.resting.tolist() == resting.astype(int).tolist()
    x = middle + (0.9 - middle) * np.cos(w * t)
    np.testing.assert_allclose(trajectory.states[resting, 6], x[resting], atol=1e-12)
    assert (trajectory.states[resting, 1] == ANGLE).all()
    # The couple of the stop balances the load.
    couples = [couple_of(s, y) for s, y in zip(trajectory.systems, trajectory.states, strict=True)]
    np.testing.assert_allclose(couples, np.where(resting, -(LOAD + COUPLING * x), 0), atol=1e-11)
    # After it: ẍ = (cθ - kx)/m, θ̈ = (C + cx)/J, as a matrix exponential with a constant.
    matrix = np.zeros((5, 5))
    matrix[0, 2] = matrix[1, 3] = 1.0
    matrix[2, :2] = -STIFFNESS / MASS, COUPLING / MASS
    matrix[3, [0, 4]] = COUPLING / INERTIA, LOAD / INERTIA
    first = np.array([-LOAD / COUPLING, ANGLE, -(0.9 - middle) * w * np.sin(w * release), 0.0, 1.0])
    meets = trajectory.impacts.times[0] if len(trajectory.impacts.times) else np.inf
    flying = (t > release) & (t < meets)
    assert flying.sum() > 20
    expected = np.array([expm(matrix * (time - release)) @ first for time in t[flying]])
    np.testing.assert_allclose(trajectory.states[flying][:, [6, 1]], expected[:, :2], atol=1e-11)


def hanging(restitution=0.5, **sections):
    """Return a body without symmetry, held at its point, whose weight presses it on its stop."""
    controller = {"variant": "permanent", "K_t": [40.0] * 3, "L_t": [9.0] * 3}
    controller |= {"K_r": [9.0] * 3, "L_r": [3.0] * 3}
    config = data(
        {"end": stop(restitution)},
        {"angular_velocity": [0.5, 1.0, -0.3]},
        {"duration": 12.0, "samples": 61},
        controller=controller,
        gravity=[0.0, 0.0, -9.81],
    )
    inertia = [[1.0, 0.1, -0.2], [0.1, 1.5, 0.15], [-0.2, 0.15, 2.0]]
    config["body"] |= {"inertia": inertia, "contact_point": [-0.8, 0.1, -0.2]}
    return config | sections


def energy_at(system, Theta):
    """Return the energy of the elements of a held body at rest at some angles."""
    return system.potential_energy(np.concatenate([Theta, np.zeros(3)]))


@EACH
def test_rest_contact_of_the_held_body_is_the_static_balance(engine_name):
    """τ = ∂Π/∂θ2 there, by differences, and the other derivatives vanish."""
    config = hanging()
    trajectory = solved(config, engine_name)
    assert trajectory.status == "completed"
    assert trajectory.impacts.resting[-1] == 1
    system, y = trajectory.systems[-1], trajectory.states[-1]
    slopes = []
    for axis in np.eye(3):
        low, high = (energy_at(system, y[:3] + step * axis) for step in (-1e-4, 1e-4))
        slopes.append((high - low) / 2e-4)
    assert slopes[1] < -1.0
    np.testing.assert_allclose(np.array(slopes)[[0, 2]], 0, atol=1e-5)
    assert abs(couple_of(system, y) - slopes[1]) < 1e-5
    # Without the stop the body would go on.
    rest = nearest_rest_state(problem(hanging()).system)
    np.testing.assert_allclose(y[:3], rest.motion.Theta, atol=1e-6)


@EACH
def test_a_long_rest_does_not_drift(engine_name):
    """At a loose tolerance, through many steps: θ2 and its rate stay, and v balances."""
    settings = {"duration": 30.0, "samples": 31, "engine": engine_name, "rtol": 1e-6}
    config = hanging() | {"integration": settings}
    config["controller"] |= {"L_t": [0.1] * 3, "L_r": [0.1] * 3}
    config["initial"] = {"orientation": [0.0, ANGLE, 0.0], "angular_velocity": [0.3, 0.0, 0.3]}
    trajectory = solution(problem(config), engine_name)
    assert trajectory.status == "completed"
    assert (trajectory.impacts.resting == 1).all()
    assert (trajectory.states[:, 1] == ANGLE).all()
    pairs = zip(trajectory.systems, trajectory.states, strict=True)
    rates = [(system.motion(y).B @ y[3:6])[1] for system, y in pairs]
    assert np.abs(rates).max() < 1e-15
    assert np.abs(trajectory.states[:, 3]).max() > 0.01
    v = energies(trajectory)
    assert residual(trajectory) < 1e-4 * (v[0] - v[-1])
