"""Configs with random starts, and sets of states around them."""

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment.convergence.enclosed_system import state_scale
from rbstab.proof.motion.monomials import monomials_up_to
from rbstab.proof.motion.motion_set import MotionSet
from support.configs import BY_VARIANT, plain

FULL = [[500.0, 40.0, -30.0], [40.0, 420.0, 25.0], [-30.0, 25.0, 300.0]]

VARIANTS = [
    ("free", "Z"),
    ("permanent", "reduced"),
    ("visco-elastic", "Z"),
    ("visco-elastic", "W"),
    ("embedded", "Z"),
]


def random_config(variant, coordinates, seed=0, **changes):
    """Return a config with a random body and start, full gains, gravity, and any anchor."""
    rng, data = np.random.default_rng(seed), plain(BY_VARIANT[variant])
    data["body"] = {
        "mass": round(rng.uniform(10, 50), 3),
        "inertia": [[10.0, 0.5, -0.3], [0.5, 8.0, 0.2], [-0.3, 0.2, round(rng.uniform(3, 9), 2)]],
        "contact_point": rng.uniform(-0.4, 0.4, 3).round(3).tolist(),
    }
    initial = {
        "orientation": rng.uniform(-0.6, 0.6, 3).round(3).tolist(),
        "angular_velocity": rng.uniform(-10, 10, 3).round(3).tolist(),
    }
    if variant != "permanent":
        initial |= {
            "position": rng.uniform(-0.05, 0.05, 3).round(3).tolist(),
            "velocity": rng.uniform(-1, 1, 3).round(3).tolist(),
        }
    data["gravity"] = rng.uniform(-10, 10, 3).round(3).tolist()
    data["controller"]["K_r"] = FULL
    if variant != "free":
        data["controller"]["anchor"] = "equilibrium"
    data["integration"]["coordinates"] = coordinates
    return load_config({**data, "initial": initial, **changes})


def random_set(config, seed=0, *, width=1e-2, error=1e-6, variables=2, degree=4):
    """Return a set of states about the start of a config, in a set of one, and the size of each.

    Its polynomial has terms of all degrees, and its frame is not orthonormal.
    """
    rng, scale = np.random.default_rng(seed), state_scale(problem_of(config))
    start = problem_of(config).start
    space = monomials_up_to(variables, degree)
    shape = (len(start), len(space))
    polynomial = rng.uniform(-1, 1, shape) * width**space.degrees
    polynomial *= scale[:, np.newaxis]
    polynomial[:, 0] = start
    n = len(start)
    frame = scale[:, np.newaxis] * (np.eye(n) + 0.1 * rng.uniform(-1, 1, (n, n)))
    parts = (part[np.newaxis] for part in (polynomial, frame, np.full(n, error)))
    return MotionSet(space, *parts), scale


def together(*sets):
    """Return several sets of motions as one `MotionSet`, in their order."""
    parts = [(motion_set.polynomial, motion_set.frame, motion_set.radius) for motion_set in sets]
    return MotionSet(sets[0].space, *map(np.concatenate, zip(*parts, strict=True)))
