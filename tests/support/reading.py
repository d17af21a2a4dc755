"""The motion and the energy of a state vector, from geometry alone."""

from typing import NamedTuple

import numpy as np

from support.differences import derivative
from support.particles import particles
from support.pose import attitude, turned

Array = np.ndarray


class Reading(NamedTuple):
    """The motion at a state vector, and the state D of an embedded connector."""

    Theta: Array
    Omega: Array
    X: Array
    V: Array
    A: Array
    E: Array
    F: Array
    D: Array


def read(system, y):
    """Return the motion at a state vector of any coordinates."""
    Theta, Omega, rest = y[0:3], y[3:6], y[6 : system.coordinates.size]
    R, home = system.body.contact_point, system.body.contact_point + system.anchor
    A = attitude(Theta)
    turning = derivative(lambda t: turned(A, Omega, t) @ R)
    if system.coordinates.name in {"Z", "manifold"}:
        X, V = rest[0:3], rest[3:6]
        E, F = X + A @ R - home, V + turning
    else:
        E, F = (rest[0:3], rest[3:6]) if len(rest) else np.zeros((2, 3))
        X, V = E + home - A @ R, F - turning
    return Reading(Theta, Omega, X, V, A, E, F, y[system.coordinates.size :])


def gain(system, name):
    """Return a gain from the one element that has it."""
    [value] = [getattr(element, name) for element in system.elements if hasattr(element, name)]
    return value


def kinetic_energy(body, reading):
    """Return Σ ½ m ẋ'ẋ over the body's particles."""
    masses, places = particles(body)
    carried = derivative(lambda t: places @ turned(reading.A, reading.Omega, t).T)
    velocities = reading.V + carried
    return 0.5 * masses @ (velocities**2).sum(axis=1)


def stored_energy(system, reading):
    """Return the energy of the springs and the weight (eq. 25, 27, 41, 44) of a system."""
    have = {name for element in system.elements for name in vars(element)}
    X, Theta, E, D = reading.X, reading.Theta, reading.E, reading.D
    energy = 0.5 * X @ gain(system, "K_t") @ X + 0.5 * Theta @ gain(system, "K_r") @ Theta
    energy -= gain(system, "weight") @ X
    if "K_d" in have:
        energy += 0.5 * (E - D) @ gain(system, "K_c") @ (E - D) + 0.5 * D @ gain(system, "K_d") @ D
    elif "K_c" in have:
        energy += 0.5 * E @ gain(system, "K_c") @ E
    return energy


def total_energy(system, y):
    reading = read(system, y)
    return kinetic_energy(system.body, reading) + stored_energy(system, reading)
