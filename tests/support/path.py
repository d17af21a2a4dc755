"""A body moved along a given path Θ(t), X(t): its state, its rates, and the force it needs."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.body import Body
from support.differences import derivative, second_derivative
from support.particles import particles
from support.pose import attitude


@dataclass(frozen=True)
class Path:
    body: Body
    Theta: Callable
    X: Callable

    def A(self, t):
        return attitude(self.Theta(t))

    def Omega(self, t):
        """Return the angular velocity from the attitude, A'Ȧ, in body coordinates."""
        spin = self.A(t).T @ derivative(lambda s: self.A(t + s))
        return np.array([spin[2, 1], spin[0, 2], spin[1, 0]])

    def V(self, t):
        return derivative(lambda s: self.X(t + s))

    def contact(self, t):
        """Return the position of C, inertial."""
        return self.X(t) + self.A(t) @ self.body.contact_point

    def Z(self, t=0.0):
        return np.concatenate([self.Theta(t), self.Omega(t), self.X(t), self.V(t)])

    def Z_rates(self):
        return derivative(self.Z)

    def _places(self, t):
        return self.X(t) + particles(self.body)[1] @ self.A(t).T

    def force(self):
        """Return the force that moves the particles, Σ m ẍ, inertial."""
        masses, _ = particles(self.body)
        return masses @ second_derivative(self._places)

    def moment_about(self, point):
        """Return the moment that moves the particles, Σ (x - point) × m ẍ, inertial."""
        masses, _ = particles(self.body)
        moments = np.cross(self._places(0.0) - point, second_derivative(self._places))
        return masses @ moments


def _smooth(rng, start, speed):
    velocity, acceleration = rng.normal(size=(2, 3)) * speed
    return lambda t: start + velocity * t + acceleration * t**2 / 2


def _angles(rng):
    return _smooth(rng, rng.uniform(-1, 1, size=3) * np.array([3.0, 1.3, 3.0]), 2.0)


def random_path(rng, body):
    return Path(body, _angles(rng), _smooth(rng, rng.normal(size=3), 2.0))


def held_path(rng, body, anchor):
    """Return a random path on which C stays at R + X_a."""
    Theta, R = _angles(rng), body.contact_point
    return Path(body, Theta, lambda t: R + anchor - attitude(Theta(t)) @ R)
