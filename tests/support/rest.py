"""Systems whose rest states are known."""

import numpy as np

from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.mechanics.body import Body
from rbstab.systems.coordinates import CentreCoordinates, ReducedCoordinates
from rbstab.systems.system import System
from support.systems import random_system

HEAVY = (0.0, 0.0, -410.0)
WEIGHTLESS = (0.0, 0.0, 0.0)

K_T = np.diag([4100.0, 4100.0, 3280.0])
K_R = np.diag([400.0, 400.0, 320.0])
K_C = np.diag([12300.0, 12300.0, 9840.0])
DAMPING = np.diag([60.0, 60.0, 42.0])

CONNECTORS = {
    "free": (),
    "permanent": (),
    "visco-elastic": (ViscoElasticConnector(K_C, DAMPING),),
    "embedded": (EmbeddedConnector(K_C, DAMPING, K_C, DAMPING),),
}


def coordinates_of(variant):
    return ReducedCoordinates() if variant == "permanent" else CentreCoordinates()


def paper_system(variant, K_r_scale=1.0, weight=WEIGHTLESS, anchor=(0.0, 0.0, 0.0)):
    """A paper's case at rest: damping has no part in it."""
    elements = (
        Gravity(np.array(weight)),
        TranslationalStabilizer(K_T, DAMPING),
        RotationalStabilizer(K_r_scale * K_R, DAMPING),
        *CONNECTORS[variant],
    )
    body = Body(41.0, np.diag([10.0, 8.0, 0.4]), np.array([0.15, 0.10, -0.42]))
    return System(body, elements, coordinates_of(variant), np.array(anchor))


def random_rest_system(rng, variant):
    """Full gains, gravity and an anchor, all random."""
    return random_system(rng, variant, coordinates_of(variant))


def inverted_pendulum(stiffness, moment):
    """A body that stands on its contact point, with springs to each of its Euler angles.

    U = ½ Σ k_i θ_i² - a (1 - cos θ1 cos θ2) with the moment a of its weight about the contact point
    when it lies flat. Where k2 > a a rest state has θ2 = θ3 = 0 and k1 θ1 = a sin θ1.
    """
    elements = (
        Gravity(np.array([0.0, 0.0, -moment])),
        RotationalStabilizer(np.diag(np.asarray(stiffness, dtype=float)), DAMPING),
    )
    body = Body(1.0, np.eye(3), np.array([0.0, 0.0, -1.0]))
    return System(body, elements, ReducedCoordinates(), np.zeros(3))
