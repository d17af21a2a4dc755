"""The problem as every peer gets it, and the reference solution."""

from typing import Any

import numpy as np

from benchmarks.peers.rbstab_sweep import motions_of
from benchmarks.swept import plan_of
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.plan import Plan

SAMPLES = 201
REFERENCE_SETTINGS = ("integration.engine=heyoka", "integration.rtol=1e-15")
GAINS = ("K_t", "L_t", "K_r", "L_r", "K_c", "L_c")


def problem_of_members(members: int) -> dict[str, Any]:
    """Return the parameters, the samples and the initial states of members (see `serve.Problem`).

    The members are those of the other benchmarks: random initial spins about the axes 1 and 2.
    """
    plan = plan_of(members, SAMPLES)
    config = plan.config_of(0)
    gains = {name: list(getattr(config.controller, name)) for name in GAINS}
    return {
        "mass": config.body.mass,
        "inertia": list(config.body.inertia),
        "contact_point": list(config.body.contact_point),
        **gains,
        "times": np.linspace(0.0, config.integration.duration, SAMPLES).tolist(),
        "starts": starts_of(plan).tolist(),
    }


def starts_of(plan: Plan) -> Array:
    """Return the initial states [Θ, Ω, X, V] of all members, shape (members, 12)."""
    initial = plan.config_of(0).initial.model_dump()
    names = ("orientation", "angular_velocity", "position", "velocity")
    starts = np.tile(np.concatenate([initial[name] for name in names]), (plan.members, 1))
    for key, values in plan.values(0, plan.members).items():
        axis = int(key.removeprefix("initial.angular_velocity[").removesuffix("]"))
        starts[:, 3 + axis] = values
    return starts


def reference_of(members: int) -> Array:
    """Return accurate states of the first members, shape (members, samples, 12)."""
    return motions_of(members, SAMPLES, REFERENCE_SETTINGS)


def largest_error(states: Array, reference: Array) -> float:
    """Return the largest relative error of the states.

    For each member and each of Θ, Ω, X and V, it is the largest distance of the samples, divided by
    the largest length of that vector. NaN counts as infinite.

    Args:
        states: Shape (members, samples, 12).
        reference: The reference, for at least as many members.
    """
    expected = reference[: len(states)]
    if states.shape != expected.shape:
        raise ValueError(f"the states have the shape {states.shape}, not {expected.shape}")
    shape = (*states.shape[:2], 4, 3)
    distance = np.linalg.norm((states - expected).reshape(shape), axis=3).max(axis=1)
    length = np.linalg.norm(expected.reshape(shape), axis=3).max(axis=1)
    return float(np.nan_to_num(distance / length, nan=np.inf).max())
