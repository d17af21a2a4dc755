"""Bodies whose energy depends on no Euler angles, and their energy from other equations."""

from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from rbstab.analysis.exact import decimals
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of, system_of
from rbstab.config.load import load_config
from rbstab.config.user_code.permission import without_code
from rbstab.proof.boxes import Box
from rbstab.proof.rotations.energy import RotationEnergy, rotation_energy
from rbstab.proof.rotations.states import RestRotation
from rbstab.proof.zeros import Zero
from rbstab.systems.system import System
from support.differences import hessian

BODY = {"mass": 2, "inertia": [0.02, 0.03, 0.025], "contact_point": [0, 0, 0]}


def config_of(elements, **more):
    """A body with some elements, and nothing else but its weight if that is given."""
    return {"schema_version": 2, "body": BODY, "elements": elements} | {
        "integration": {"duration": 1},
        **more,
    }


def tie(point, anchor=None, K=(100, 100, 100), L=(5, 5, 5)):
    place = {"point": list(point), "anchor": list(point if anchor is None else anchor)}
    return {"kind": "visco-elastic", **place, "K_c": list(K), "L_c": list(L)}


def attitude(K, L=(0.1, 0.1, 0.1)):
    return {"kind": "attitude", "K": list(K), "L": list(L)}


def held(elements, gains=None, **more):
    """The same body held at a point below its centre of gravity, without K_r."""
    L_r = {"L_r": [0.1, 0.1, 0.1]}
    body = BODY | {"contact_point": [0.05, -0.02, -0.2]}
    controller = {"variant": "permanent", **L_r, **(gains or {})}
    return config_of(elements, body=body, controller=controller, gravity=[0, 0, -9.81], **more)


class Traced(NamedTuple):
    system: System
    energy: RotationEnergy
    exact: System


def traced(config):
    """The energy of a config on rotations, with its system in doubles and in rational numbers."""
    config = load_config(config)
    system = smooth_rest_system(problem_of(config))
    exact_system = partial(system_of, without_code(config))
    return Traced(system, rotation_energy(system, exact_system), exact_system(decimals))


def rotation_of(q):
    return Rotation.from_quat(q, scalar_first=True).as_matrix()


def zero_of_chart(chart, point, reach=1e-9, domain=1e-3, index=0):
    """A rest state near a point of a chart, as if it were proved."""
    x = np.array(point, dtype=float)
    place = Zero(x, Box(x - reach, x + reach), Box(x - domain, x + domain), index, 0.0)
    q = np.insert(x, chart, 1.0)
    return RestRotation(q / np.linalg.norm(q), reach, index, 0.0, 0.0, chart, place)


MOUNTS = [(x, y, -0.15) for x in (0.3, -0.3) for y in (0.2, -0.2)]
STIFFNESS = np.array([2000.0, 3000.0, 8000.0])


def four_mounts():
    """A machine on four mounts, without a weight: K = 2, 3 and 8 kN/m each."""
    elements = {f"m{k}": tie(p, K=STIFFNESS, L=(2, 3, 8)) for k, p in enumerate(MOUNTS)}
    return config_of(elements, body={**BODY, "mass": 20})


def energy_of_mounts(A):
    """Its energy: Σ ½ e'Ke with e = (A - I)(p - p̄), as X is free and all K are equal."""
    away = np.array(MOUNTS) - np.mean(MOUNTS, axis=0)
    e = away @ (A - np.eye(3)).T
    return 0.5 * float((STIFFNESS * e * e).sum())


def stationary_points(energy, count, seed):
    """Rotations where an energy is stationary, from random starts: by differences along turns."""

    def turned(A, x):
        return A @ Rotation.from_rotvec(x).as_matrix()

    def slopes(A, h=1e-5):
        return [(energy(turned(A, h * d)) - energy(turned(A, -h * d))) / (2 * h) for d in np.eye(3)]

    points = []
    for start in Rotation.random(count, random_state=seed).as_matrix():
        end = root(lambda x, A=start: slopes(turned(A, x)), np.zeros(3), tol=1e-10)
        if end.success and np.abs(end.fun).max() < 1e-5:
            points.append(turned(start, end.x))
    return points


def negative_directions(energy, A):
    """The number of negative eigenvalues of the Hessian along turns, by differences."""

    def at(x):
        return energy(A @ Rotation.from_rotvec(x).as_matrix())

    return int((np.linalg.eigvalsh(hessian(at, np.zeros(3), 1e-3)) < 0).sum())
