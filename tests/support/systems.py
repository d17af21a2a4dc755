"""The paper's variants, and random systems without any symmetry."""

from typing import Any

import numpy as np

from rbstab.elements.element import Element
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.gravity import Gravity
from rbstab.elements.registry import CONNECTORS
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.mechanics.body import Body
from rbstab.systems.coordinates import CentreCoordinates
from rbstab.systems.system import System
from support.elements import random_element, random_spd

Array = np.ndarray[Any, np.dtype[np.float64]]

VARIANTS = ("free", "permanent", "visco-elastic", "embedded")


def random_body(rng):
    """Return a body with a full inertia matrix, which may be physically impossible."""
    return Body(float(rng.uniform(1, 50)), random_spd(rng, 3.0), rng.normal(size=3) * 0.4)


def random_elements(rng, variant):
    """Return gravity, both stabilizers and the variant's connector, with full gain matrices.

    A variant is one of `VARIANTS` or any name of a connector in the registry.
    """
    elements: list[Element] = [
        Gravity(rng.normal(size=3) * 100),
        TranslationalStabilizer(random_spd(rng, 900), random_spd(rng, 40)),
        RotationalStabilizer(random_spd(rng, 90), random_spd(rng, 12)),
    ]
    if variant == "visco-elastic":
        elements.append(ViscoElasticConnector(random_spd(rng, 2000), random_spd(rng, 90)))
    elif variant == "embedded":
        gains = [random_spd(rng, scale) for scale in (2000, 90, 1500, 150)]
        elements.append(EmbeddedConnector(*gains))
    elif variant in CONNECTORS:
        elements.append(random_element(rng, CONNECTORS[variant]))
    return tuple(elements)


def random_system(rng, variant, coordinates=None):
    """Return a random system of a variant with a random anchor; by default in coordinates Z."""
    return System(
        random_body(rng),
        random_elements(rng, variant),
        coordinates or CentreCoordinates(),
        rng.normal(size=3) * 0.1,
    )


def random_Z(rng):
    """Return a random state [Θ, Ω, X, V] with θ2 well inside its range."""
    Theta = rng.uniform(-1, 1, size=3) * np.array([3.0, 1.3, 3.0])
    return np.concatenate([Theta, rng.normal(size=3) * 5, rng.normal(size=6)])


def random_state(rng, system):
    """Return a random state vector of a system (in `manifold`: not on the constraint manifold)."""
    size = system.coordinates.size
    states = rng.normal(size=system.size - size) * 0.2
    return np.concatenate([random_Z(rng)[:size], states])
