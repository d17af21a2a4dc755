"""Configs with full gains and random starts, and the sets from which their motions are enclosed."""

import numpy as np
from flint import ctx

from rbstab.analysis.motion_proof.dual import decimal_duals
from rbstab.analysis.motion_proof.motion import scale_of, start_set
from rbstab.config.build import problem_of, start_of, system_of
from rbstab.config.load import load_config
from support.configs import BY_VARIANT, plain

FULL = [[500.0, 40.0, -30.0], [40.0, 420.0, 25.0], [-30.0, 25.0, 300.0]]


def config_of(variant, seed=0, **changes):
    """Return a config with a random start, full gains, and gravity."""
    rng = np.random.default_rng(seed)
    data = plain(BY_VARIANT[variant])
    initial = {
        "orientation": rng.uniform(-0.6, 0.6, 3).round(3).tolist(),
        "angular_velocity": rng.uniform(-20, 20, 3).round(3).tolist(),
    }
    if variant != "permanent":
        initial |= {
            "position": rng.uniform(-0.05, 0.05, 3).round(3).tolist(),
            "velocity": rng.uniform(-1, 1, 3).round(3).tolist(),
        }
    data["gravity"] = rng.uniform(-10, 10, 3).round(3).tolist()
    data["controller"]["K_r"] = FULL
    return load_config({**data, "initial": initial, **changes})


def enclosure(config):
    """Return the equations, the set of the start, and the scale of the states."""
    system, problem = system_of(config, decimal_duals), problem_of(config)
    energy = float(np.abs(problem.system.observe(problem.start).energy).sum())
    scale = scale_of(problem.system, energy)
    return system, start_set(start_of(config, system, decimal_duals), scale), scale


def outside(exact, middle, distance):
    """Return by how much each state is outside its enclosure, relative to the width."""
    with ctx.workprec(220):
        return [
            max(0.0, float(abs(e - m)) / d - 1)
            for e, m, d in zip(exact, middle, distance, strict=True)
        ]
