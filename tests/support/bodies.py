"""Boxes of bodies: configs with tolerances, their members, and what scipy finds for a member."""

from fractions import Fraction
from typing import Any

import numpy as np
from scipy.optimize import minimize

import rbstab
from rbstab.config.load import load_config
from rbstab.config.schema import Config
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.robust.bodies import members_of
from rbstab.proof.robust.numbers import Members, Part
from support.config_elements import BAND, CONTROLLER, HELD, config_data, guard
from support.paper_runs import paper_config


def config_of(variant, *, scale=1.0, **sections):
    """Return a paper's body with K_r times a scale, and with other sections changed."""
    changes = sections.pop("controller", {})
    gains = {"K_r": [scale * 400.0, scale * 400.0, scale * 320.0], **changes}
    data = paper_config(variant, controller=gains)
    data["gravity"] = [0.0, 0.0, 0.0]
    for name, entries in sections.items():
        data[name] = {**data[name], **entries} if isinstance(entries, dict) else entries
    return rbstab.load_config(data)


HEAVY = [0.0, 1.0, -9.81]
FULL = {
    "K_t": [[4100, 600, 0], [600, 4100, -300], [0, -300, 3280]],
    "K_r": [[400, 50, 20], [50, 400, 0], [20, 0, 320]],
}
STRUT: dict[str, Any] = {"kind": "spring", "point": [0.02, 0.0, 0.3], "anchor": [0.3, 0.01, 1.0]}
STRUT |= {"stiffness": 900.0, "rest_length": 0.5}
BAND |= {"stiffness": 100.0, "slack_length": 0.3, "toe_strain": 0.2, "damping": 8.0}


def with_element(element, controller=HELD):
    """Return a config with one element."""
    return load_config(config_data({"one": element}, controller))


CASES: list[tuple[Config, list[str]]] = [
    (config_of("permanent"), ["controller=±20%", "body.contact_point=±0.01"]),
    (config_of("permanent", gravity=HEAVY), ["controller=±5%", "gravity=±0.2", "body.mass=±2%"]),
    (config_of("visco-elastic"), ["controller=±20%", "body.contact_point=±0.01"]),
    (config_of("visco-elastic", controller=FULL), ["controller=±10%"]),
    (config_of("embedded"), ["controller=±20%", "body.contact_point=±0.01"]),
    (config_of("free", gravity=HEAVY), ["controller=±20%"]),
    (with_element(STRUT), ["controller=±5%", "elements.one.stiffness=±10%"]),
    (with_element(STRUT), ["elements.one.rest_length=±2%"]),
    (with_element(BAND), ["controller=±5%", "elements.one.stiffness=±10%"]),
    (
        with_element(guard("barrier", stiffness=30.0)),
        ["controller=±10%", "elements.one.stiffness=±20%"],
    ),
    (
        with_element(guard("stiff", stiffness=50.0, soft_angle=0.9)),
        ["controller=±5%", "elements.one.soft_angle=±1%"],
    ),
    (with_element(guard("repelling", couple=5.0, soft_angle=0.9)), ["controller=±10%"]),
    (with_element(guard("stop", restitution=0.5, angle=1.2)), ["controller=±10%"]),
    (with_element(guard("stop", restitution=0.5, angle=1.2), CONTROLLER), ["controller=±10%"]),
]
"""Boxes of bodies for which one rest state is proved."""


def box_of(config, *texts) -> tuple[Members, Part]:
    """Return the members of a config within tolerances, and their box."""
    tolerances = tolerances_of(config, texts)
    part = Part(
        tuple(tolerance.middle for tolerance in tolerances),
        tuple(tolerance.radius for tolerance in tolerances),
    )
    return members_of(config, tolerances), part


def some_bodies(part, rng, count, *, corners=True):
    """Return the numbers of random bodies in a box; half of them are corners."""
    bodies = []
    for index in range(count):
        z = rng.uniform(-1, 1, size=len(part.middle))
        if corners and index % 2:
            z = np.sign(z)
        pairs = zip(part.middle, part.radius, z.tolist(), strict=True)
        bodies.append(tuple(middle + radius * Fraction(value) for middle, radius, value in pairs))
    return bodies


def member(members, numbers):
    """Return the system of one body in doubles."""
    return members.from_doubles([float(number) for number in numbers])


def least_over_x(at_rest, Theta):
    """Return the configuration of least energy at Θ; the energy is quadratic in all but Θ."""
    n = at_rest.size - 3
    q = np.concatenate([Theta, np.zeros(n)])
    if not n:
        return q
    slope = at_rest.gradient(q)[3:]
    steps = np.eye(at_rest.size)[3:]
    H = np.array([at_rest.gradient(q + step)[3:] - slope for step in steps])
    q[3:] = np.linalg.solve(H.T, -slope)
    return q


def least_energy(at_rest, axis, angle, rng, starts, *, end=np.inf):
    """Return the least energy with one angle fixed, from random starts; the others within ±end."""
    high = np.full(at_rest.size, np.inf)
    high[:3] = end
    low = -high
    low[axis] = high[axis] = angle
    energies, tight = [], {"ftol": 0.0, "gtol": 0.0}
    for _ in range(starts):
        q = np.zeros(at_rest.size)
        q[:3] = rng.uniform(-5, 5, 3)
        bounds = np.stack([low, high], axis=1)
        start = np.clip(q, low, high)
        done = minimize(at_rest.energy, start, jac=at_rest.gradient, bounds=bounds, options=tight)
        energies.append(float(done.fun))
    return min(energies)
