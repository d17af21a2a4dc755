"""Bodies held at their contact point, with springs; and their energies by formulas of their own."""

import numpy as np

from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.mechanics.body import Body
from rbstab.systems.coordinates import ReducedCoordinates
from rbstab.systems.system import System
from support.pose import attitude

R = np.array([0.15, 0.10, -0.42])
K_T = np.diag([4100.0, 4100.0, 3280.0])
K_R = np.diag([400.0, 400.0, 320.0])
DAMPING = np.diag([60.0, 60.0, 42.0])
WEIGHT = np.array([0.0, 0.0, -410.0])


def held_system(springs, soft=0.3, *others):
    """Return the paper's body, held at its contact point, with springs and `soft` times K_r."""
    elements = (
        Gravity(WEIGHT),
        TranslationalStabilizer(K_T, DAMPING),
        RotationalStabilizer(soft * K_R, DAMPING),
        *springs,
        *others,
    )
    body = Body(41.0, np.diag([10.0, 8.0, 0.4]), R)
    return System(body, elements, ReducedCoordinates(), np.zeros(3))


def length_of(spring, Theta):
    """Return the distance of both ends of a spring of a held body, without the program."""
    return float(np.linalg.norm(R + attitude(Theta) @ (spring.point - R) - spring.anchor))


def energy_of(springs, Theta, soft=0.3):
    """Return the stored energy of `held_system` at Θ, without the program."""
    X = R - attitude(Theta) @ R
    held = 0.5 * X @ K_T @ X - WEIGHT @ X + 0.5 * soft * Theta @ K_R @ Theta
    for one in springs:
        held += 0.5 * one.stiffness * (length_of(one, Theta) - one.rest_length) ** 2
    return float(held)
