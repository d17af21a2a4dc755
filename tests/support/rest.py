"""Systems with known rest states."""

import numpy as np

from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.mechanics.body import Body
from rbstab.systems.coordinates import CentreCoordinates, ReducedCoordinates
from support.problems import bare_system
from support.systems import random_system

HEAVY = (0.0, 0.0, -410.0)
WEIGHTLESS = (0.0, 0.0, 0.0)

K_T = np.diag([4100.0, 4100.0, 3280.0])
K_R = np.diag([400.0, 400.0, 320.0])
K_C = np.diag([12300.0, 12300.0, 9840.0])
DAMPING = np.diag([60.0, 60.0, 42.0])

SADDLES = np.array([[-1.330, 1.514, -2.447], [-2.682, 0.851, -1.382]])
"""Θ of the two saddles of the permanent paper body with a tenth of K_r, to three decimals."""

CONNECTORS = {
    "free": (),
    "permanent": (),
    "visco-elastic": (ViscoElasticConnector(K_C, DAMPING),),
    "embedded": (EmbeddedConnector(K_C, DAMPING, K_C, DAMPING),),
}


def coordinates_of(variant):
    return ReducedCoordinates() if variant == "permanent" else CentreCoordinates()


def paper_system(variant, K_r_scale=1.0, weight=WEIGHTLESS, anchor=(0.0, 0.0, 0.0)):
    """Return a paper's case; its damping is arbitrary, because rest states do not depend on it."""
    body = Body(41.0, np.diag([10.0, 8.0, 0.4]), np.array([0.15, 0.10, -0.42]))
    return bare_system(
        body,
        coordinates_of(variant),
        weight=weight,
        K_t=K_T,
        L_t=DAMPING,
        K_r=K_r_scale * K_R,
        L_r=DAMPING,
        anchor=anchor,
        others=CONNECTORS[variant],
    )


def random_rest_system(rng, variant):
    """Return a system with random full gains, gravity and anchor."""
    return random_system(rng, variant, coordinates_of(variant))


def system_of(variant, seed=0):
    """Return the random system of a variant that belongs to a seed."""
    return random_rest_system(np.random.default_rng(seed), variant)


def inverted_pendulum(stiffness, moment):
    """Return a body upright on its contact point, with a spring on each of its Euler angles.

    U = ½ Σ k_i θ_i² - a (1 - cos θ1 cos θ2). Here a is the moment of the weight about the contact
    point when the body lies flat. If k2 > a, a rest state has θ2 = θ3 = 0 and k1 θ1 = a sin θ1.
    """
    body = Body(1.0, np.eye(3), np.array([0.0, 0.0, -1.0]))
    gains = {"K_r": np.diag(np.asarray(stiffness, dtype=float)), "L_r": DAMPING}
    return bare_system(body, ReducedCoordinates(), weight=(0.0, 0.0, -moment), **gains)
