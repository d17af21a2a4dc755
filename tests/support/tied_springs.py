"""Bodies tied by a connector, with springs; and their energies by formulas of their own."""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import root

from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.ligament import Ligament
from rbstab.elements.spring import Spring
from rbstab.elements.visco_elastic import ViscoElasticConnector
from support.pose import attitude
from support.rest import DAMPING, HEAVY, K_R, K_T, paper_system

R = np.array([0.15, 0.10, -0.42])
K_C = np.array([[9000.0, 500.0, 0.0], [500.0, 8000.0, -300.0], [0.0, -300.0, 7000.0]])
K_D = np.diag([20000.0, 15000.0, 30000.0])


def spring_of(point=(0.1, 0.2, 0.3), anchor=(0.5, 0.1, 0.9), stiffness=900.0, rest_length=0.5):
    """Return a spring."""
    ends = {"point": np.array(point), "anchor": np.array(anchor)}
    constants = {"stiffness": stiffness, "rest_length": rest_length, "damping": 5.0}
    return Spring(name="spring", **ends, **constants)


def ligament_of():
    """Return a ligament that is taut at Θ = 0."""
    ends = {"point": np.array([0.1, 0.2, 0.3]), "anchor": np.array([0.5, 0.1, 0.5])}
    law: dict[str, Any] = {"stiffness": 400.0, "slack_length": 0.3, "toe_strain": 0.05}
    return Ligament(name="ligament", damping=5.0, **ends, **law)


def tied_system(springs, soft=1.0, K_d=None, *others):
    """Return the paper's body, tied at its contact point, with springs and `soft` times K_r."""
    connector: ViscoElasticConnector | EmbeddedConnector
    if K_d is None:
        connector = ViscoElasticConnector(K_C, DAMPING)
    else:
        connector = EmbeddedConnector(K_C, DAMPING, K_d, DAMPING)
    free = paper_system("free", soft, HEAVY)
    return replace(free, elements=(*free.elements, connector, *springs, *others))


def energy_of(springs, Theta, X, *, soft=1.0, K_d=None):
    """Return the least stored energy of `tied_system` over D, without the program."""
    series = K_C if K_d is None else np.linalg.inv(np.linalg.inv(K_C) + np.linalg.inv(K_d))
    A = attitude(Theta)
    E = X + A @ R - R
    energy = (
        0.5 * X @ K_T @ X
        - np.dot(HEAVY, X)
        + 0.5 * soft * Theta @ K_R @ Theta
        + 0.5 * E @ series @ E
    )
    for spring in springs:
        length = np.linalg.norm(X + A @ spring.point - spring.anchor)
        energy += 0.5 * spring.stiffness * (length - spring.rest_length) ** 2
    return float(energy)


def slope_of(springs, **changes):
    """Return the gradient of `energy_of` in [Θ, X], by central differences."""

    def slope(y):
        steps = 1e-5 * np.eye(6)
        values = [
            [energy_of(springs, *np.split(y + sign * h, 2), **changes) for sign in (1, -1)]
            for h in steps
        ]
        return np.array([(a - b) / 2e-5 for a, b in values])

    return slope


def rest_states_by_scipy(springs, rng, starts, **changes):
    """Return rest states [Θ, X] in the range of eq. 5 that SciPy finds from random starts."""
    slope = slope_of(springs, **changes)
    end = np.array([np.pi, np.pi / 2, np.pi])
    states = list[Any]()
    for _ in range(starts):
        Theta = rng.uniform(-end, end)
        start = np.concatenate([Theta, R - attitude(Theta) @ R + 0.1 * rng.normal(size=3)])
        y = root(slope, start, tol=1e-11).x
        inside = np.all(np.abs(y[:3]) < end - 1e-6)
        listed = any(np.abs(y - other).max() < 1e-4 for other in states)
        if inside and not listed and np.abs(slope(y)).max() < 1e-3:
            states.append(y)
    return states
