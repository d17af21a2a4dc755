"""Boxes of bodies: configs with tolerances, their members, and what scipy finds for a member."""

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from scipy.optimize import minimize, root

import rbstab
from rbstab.analysis.configuration import Configurations, configurations
from rbstab.config.load import load_config
from rbstab.config.schema import Config
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.robust.bodies import members_of
from rbstab.proof.robust.numbers import Members, Part
from rbstab.systems.system import System
from support.config_elements import CONTROLLER, config_data
from support.paper_runs import paper_config
from support.systems import Array


def config_of(variant: str, *, scale: float = 1.0, **sections: Any) -> Any:
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
HELD = CONTROLLER | {"variant": "permanent"}
STRUT: dict[str, Any] = {"kind": "spring", "point": [0.02, 0.0, 0.3], "anchor": [0.3, 0.01, 1.0]}
STRUT |= {"stiffness": 900.0, "rest_length": 0.5}
BAND: dict[str, Any] = {"kind": "ligament", "point": [0.1, 0.2, 0.3], "anchor": [0.5, 0.1, 0.5]}
BAND |= {"stiffness": 100.0, "slack_length": 0.3, "toe_strain": 0.2, "damping": 8.0}


def guard(method: str, **numbers: float) -> dict[str, Any]:
    """Return a guard."""
    return {"kind": "guard", "method": method, **numbers}


def with_element(element: dict[str, Any], controller: dict[str, Any] = HELD) -> Config:
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


def box_of(config: Any, *texts: str) -> tuple[Members, Part]:
    """Return the members of a config within tolerances, and their box."""
    tolerances = tolerances_of(config, texts)
    part = Part(tuple(one.middle for one in tolerances), tuple(one.radius for one in tolerances))
    return members_of(config, tolerances), part


def some_bodies(
    part: Part, rng: np.random.Generator, count: int, *, corners: bool = True
) -> list[tuple[Fraction, ...]]:
    """Return the numbers of random bodies in a box; half of them are corners."""
    found = []
    for index in range(count):
        z = rng.uniform(-1, 1, size=len(part.middle))
        if corners and index % 2:
            z = np.sign(z)
        pairs = zip(part.middle, part.radius, z.tolist(), strict=True)
        found.append(tuple(middle + radius * Fraction(value) for middle, radius, value in pairs))
    return found


def member(members: Members, numbers: Sequence[Fraction]) -> System:
    """Return the system of one body in doubles."""
    return members.own([float(number) for number in numbers])


def least_over_x(at_rest: Configurations, Theta: Array) -> Array:
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


def rest_states_by_scipy(system: System, rng: np.random.Generator, starts: int = 12) -> list[Array]:
    """Return the Θ of the rest states in the range that scipy finds from random configurations."""
    at_rest = configurations(system)
    found: list[Array] = []
    for start in range(starts):
        q = np.zeros(at_rest.size)
        if start:
            q[:3] = rng.uniform(-1, 1, size=3) * [3.1, 1.5, 3.1]
        solution = root(at_rest.gradient, q, method="hybr", tol=1e-12)
        Theta = solution.x[:3]
        inside = np.all(np.abs(Theta) < [np.pi, np.pi / 2, np.pi])
        at_zero = np.abs(at_rest.gradient(solution.x)).max() < 1e-6
        new = all(np.abs(Theta - other).max() > 1e-5 for other in found)
        if inside and at_zero and new:
            found.append(Theta)
    return found


def lowest_on_border(system: System, rng: np.random.Generator, starts: int = 3) -> float:
    """Return the least energy on the border of the range that scipy finds."""
    at_rest = configurations(system)
    least = np.inf
    for axis in range(3):
        for sign in (-1.0, 1.0):
            end = sign * np.array([np.pi, np.pi / 2, np.pi])[axis]
            for _ in range(starts):
                least = min(least, _least_with(at_rest, axis, end, rng))
    return float(least)


def _least_with(at_rest: Configurations, axis: int, end: float, rng: np.random.Generator) -> float:
    """Return the least energy with one angle fixed, from one random start."""
    free = [index for index in range(at_rest.size) if index != axis]
    limits: list[tuple[float | None, float | None]] = [(None, None)] * at_rest.size
    limits[:3] = [(-np.pi, np.pi), (-np.pi / 2, np.pi / 2), (-np.pi, np.pi)]

    def whole(part: Array) -> Array:
        q = np.zeros(at_rest.size)
        q[axis], q[free] = end, part
        return q

    start = np.zeros(at_rest.size)
    start[:3] = rng.uniform(-1, 1, size=3) * [3.1, 1.5, 3.1]
    found = minimize(
        lambda part: float(at_rest.energy(whole(part))),
        start[free],
        jac=lambda part: at_rest.gradient(whole(part))[free],
        bounds=[limits[index] for index in free],
        method="L-BFGS-B",
    )
    return float(found.fun)
