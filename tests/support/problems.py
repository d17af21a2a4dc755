"""Initial value problems for tests, with the tolerances and limits of a default run."""

from typing import Any

import numpy as np
import pytest

from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.integrate.engines import engine
from rbstab.integrate.problem import Problem
from rbstab.mechanics.motion import motion_from_contact
from rbstab.systems.coordinates import CentreCoordinates
from rbstab.systems.system import System

ENGINES = ("scipy", "heyoka")

each_engine = pytest.mark.parametrize("engine", ENGINES)

METHODS = [
    ("scipy", "DOP853"),
    ("scipy", "RK45"),
    ("scipy", "LSODA"),
    ("scipy", "Radau"),
    ("heyoka", ""),
]
"""Each engine with each of its methods."""

ZERO_MATRIX = np.zeros((3, 3))


def problem(system, start, times, **changes):
    """Return a problem with the defaults of a config and a generous time limit."""
    settings: dict[str, Any] = {
        "rtol": 1e-12,
        "atol": 1e-12,
        "method": "DOP853",
        "range_bound": 1e-3,
        "project": False,
        "step_limit": 1_000_000,
        "time_limit": 60.0,
    }
    start, times = np.asarray(start, dtype=float), np.asarray(times, dtype=float)
    return Problem(system=system, start=start, times=times, **(settings | changes))


def solve(engine_name, given):
    """Return the trajectory of a problem, computed by the engine of that name."""
    return engine(engine_name)(given)


def bare_system(
    body,
    coordinates=None,
    *,
    weight=(0.0, 0.0, 0.0),
    K_t=ZERO_MATRIX,
    L_t=ZERO_MATRIX,
    K_r=ZERO_MATRIX,
    L_r=ZERO_MATRIX,
    anchor=(0.0, 0.0, 0.0),
    others=(),
):
    """Return a body whose stabilizers have zero gains, unless given, beside other elements.

    The stabilizers stay in with zero gains, so all these systems share one compilation.
    """
    elements = (
        Gravity(np.asarray(weight, dtype=float)),
        TranslationalStabilizer(K_t, L_t),
        RotationalStabilizer(K_r, L_r),
        *others,
    )
    return System(body, elements, coordinates or CentreCoordinates(), np.array(anchor))


def held_start(system, Theta, Omega):
    """Return the state vector of a body with orientation Θ and spin Ω whose contact point rests."""
    W = np.concatenate([Theta, Omega, np.zeros(6)])
    motion = motion_from_contact(system.body, system.anchor, W)
    return system.start(motion, np.zeros(system.size - system.coordinates.size))
