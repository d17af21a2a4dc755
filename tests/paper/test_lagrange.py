"""Eq. 1, 21 to 24 and 40 follow together from Lagrange's equations, from energies alone."""

import numpy as np
import pytest
from support.differences import derivative, jacobian, relative_error
from support.particles import particles
from support.pose import angles, attitude, turned
from support.reading import gain, read
from support.systems import random_state, random_system

from rbstab.systems.coordinates import ReducedCoordinates


class Lagrangian:
    """Energies of a system in q = [Θ, X], or [Θ] where C is held, for constant D."""

    def __init__(self, system, D):
        self.system, self.D = system, D
        self.masses, self.places = particles(system.body)
        self.connected = {name for element in system.elements for name in vars(element)}

    def centre(self, q):
        R = self.system.body.contact_point
        return q[3:6] if len(q) == 6 else R + self.system.anchor - attitude(q[0:3]) @ R

    def contact(self, q):
        """Return E."""
        R = self.system.body.contact_point
        return self.centre(q) + attitude(q[0:3]) @ R - R - self.system.anchor

    def mass_matrix(self, q):
        def places(q):
            return self.centre(q) + self.places @ attitude(q[0:3]).T

        J = jacobian(places, q)
        return np.einsum("n,nij,nik->jk", self.masses, J, J)

    def potential(self, q):
        X, E, D = self.centre(q), self.contact(q), self.D
        energy = 0.5 * X @ gain(self.system, "K_t") @ X - gain(self.system, "weight") @ X
        energy += 0.5 * q[0:3] @ gain(self.system, "K_r") @ q[0:3]
        if "K_c" in self.connected:
            stretch = E - D if len(D) else E
            energy += 0.5 * stretch @ gain(self.system, "K_c") @ stretch
        return energy

    def half_power(self, q, q_rate):
        """Return Rayleigh's function, half of the dissipated power."""

        def at(t):
            return q + t * q_rate

        V, F = derivative(lambda t: self.centre(at(t))), derivative(lambda t: self.contact(at(t)))
        Omega = spin(at)
        power = V @ gain(self.system, "L_t") @ V + Omega @ gain(self.system, "L_r") @ Omega
        if "L_c" in self.connected:
            power += F @ gain(self.system, "L_c") @ F
        return 0.5 * power

    def acceleration(self, q, q_rate):
        """Return d²q/dt² from d/dt ∂T/∂q' - ∂T/∂q + ∂U/∂q + ∂(half power)/∂q' = 0."""
        M_gradient = jacobian(self.mass_matrix, q)
        inertial = np.einsum("ijk,j,k->i", M_gradient, q_rate, q_rate)
        inertial -= 0.5 * np.einsum("jki,j,k->i", M_gradient, q_rate, q_rate)
        elastic = jacobian(self.potential, q)
        viscous = jacobian(lambda rate: self.half_power(q, rate), q_rate)
        return -np.linalg.solve(self.mass_matrix(q), inertial + elastic + viscous)


def spin(q, step=5e-3):
    """Return Ω of a path q(t) at t = 0."""
    rate = attitude(q(0.0)[0:3]).T @ derivative(lambda t: attitude(q(t)[0:3]), step)
    return np.array([rate[2, 1], rate[0, 2], rate[1, 0]])


@pytest.mark.parametrize("variant", ["free", "visco-elastic", "embedded", "permanent"])
def test_eq_01_21_22_23_24_40_follow_from_lagrange(rng, variant):
    held = variant == "permanent"
    system = random_system(rng, variant, ReducedCoordinates() if held else None)
    y = random_state(rng, system)
    reading, rates = read(system, y), system.rates(y)
    A = attitude(reading.Theta)
    Theta_rate = derivative(lambda t: angles(turned(A, reading.Omega, t)), 1e-3)
    q = reading.Theta if held else np.concatenate([reading.Theta, reading.X])
    q_rate = Theta_rate if held else np.concatenate([Theta_rate, reading.V])
    q_acceleration = Lagrangian(system, reading.D).acceleration(q, q_rate)

    def path(t):
        return q + q_rate * t + q_acceleration * t**2 / 2

    pace = max(np.abs(q_rate).max(), np.sqrt(np.abs(q_acceleration).max()))
    step = 5e-3 / pace
    Omega_rate = derivative(lambda t: spin(lambda s: path(t + s), step), step)
    # The error of second differences; small inertias magnify it.
    assert relative_error(rates[3:6], Omega_rate) < 1e-8
    if not held:
        assert relative_error(rates[9:12], q_acceleration[3:6]) < 1e-8
