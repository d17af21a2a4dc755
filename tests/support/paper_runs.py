"""The paper's cases as configs, and cached runs of them that several tests share."""

import functools
import json
from pathlib import Path
from typing import Any

import numpy as np

import rbstab
from support.systems import VARIANTS

REFERENCE: dict[str, Any] = json.loads(
    (Path(__file__).parents[1] / "data" / "paper_state.json").read_text(encoding="utf-8")
)
"""Parameters and trajectories of another program, in 80-bit floats, trusted to 15 digits."""

CASES = [(variant, with_gravity) for variant in VARIANTS for with_gravity in (False, True)]
"""Every variant without and with gravity."""

CASE_NAMES = [f"{variant}{'-gravity' if with_gravity else ''}" for variant, with_gravity in CASES]

_GAINS = ("Kt", "Lt", "Kr", "Lr", "Kc", "Lc", "Kd", "Ld")


def reference_case(variant, with_gravity):
    """Return the parameters, the initial state and the states of a variant in the reference."""
    name = variant.replace("-", "")
    case: dict[str, Any] = REFERENCE["cases"][f"{name}/{'g' if with_gravity else '0'}/S0_paper"]
    return case


def paper_config(variant, with_gravity=False, *, controller=None, initial=None, **integration):
    """Return the config of a paper's case: 401 samples over two seconds, unless changed here."""
    case = reference_case(variant, with_gravity)
    parameters = case["params"]
    gains = {f"{key[0]}_{key[1]}": parameters[key] for key in _GAINS if key in parameters}
    # The reference has the weight, a config has the acceleration.
    acceleration = [weight / parameters["m"] for weight in parameters["G"]]
    return {
        "body": {
            "mass": parameters["m"],
            "inertia": parameters["J"],
            "contact_point": parameters["R"],
        },
        "gravity": acceleration,
        "controller": {"variant": variant, **gains, **(controller or {})},
        "initial": {"angular_velocity": case["initial"]["Omega"], **(initial or {})},
        "integration": {"duration": 2.0, **integration},
    }


@functools.cache
def paper_run(variant, with_gravity, engine):
    """Return the read-only run of a paper's case at the default tolerances and samples."""
    result = rbstab.simulate(paper_config(variant, with_gravity, engine=engine))
    for variable in result.variables.values():
        variable.data.flags.writeable = False
    return result


LOOSE_TOLERANCES = (1e-4, 1e-6, 1e-8)


@functools.cache
def loose_run(engine, rtol, method="DOP853"):
    """Return half a second of the visco-elastic case with gravity, at a loose tolerance."""
    integration: dict[str, Any] = {"engine": engine, "rtol": rtol, "duration": 0.5, "samples": 6}
    if engine != "heyoka":
        integration |= {"method": method, "atol": rtol}
    config = paper_config("visco-elastic", True, **integration)
    return rbstab.simulate(config)


def paper_matrix(variant, name):
    """Return a diagonal parameter of a case as a matrix."""
    return np.diag(reference_case(variant, with_gravity=False)["params"][name])
