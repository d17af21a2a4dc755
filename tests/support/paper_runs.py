"""The paper's cases as configs, and the runs that several tests look at, each made once."""

import functools
import json
from pathlib import Path
from typing import Any

import numpy as np

import rbstab
from rbstab import Result
from support.systems import VARIANTS, Array

REFERENCE: dict[str, Any] = json.loads(
    (Path(__file__).parents[1] / "data" / "paper_state.json").read_text(encoding="utf-8")
)
"""Trajectories of another program, in 80-bit floats, trusted to 15 digits; and the parameters."""

CASES = [(variant, weighed) for variant in VARIANTS for weighed in (False, True)]
"""Every variant without and with gravity."""

CASE_NAMES = [f"{variant}{'-gravity' if weighed else ''}" for variant, weighed in CASES]

_GAINS = ("Kt", "Lt", "Kr", "Lr", "Kc", "Lc", "Kd", "Ld")


def reference_case(variant: str, weighed: bool) -> dict[str, Any]:
    """The parameters, the initial state and the states of a variant in the reference."""
    name = variant.replace("-", "")
    case: dict[str, Any] = REFERENCE["cases"][f"{name}/{'g' if weighed else '0'}/S0_paper"]
    return case


def paper_config(
    variant: str,
    weighed: bool = False,
    *,
    controller: dict[str, Any] | None = None,
    initial: dict[str, Any] | None = None,
    **integration: Any,
) -> dict[str, Any]:
    """The config of a paper's case: 401 samples over two seconds, and what is said here instead."""
    case = reference_case(variant, weighed)
    parameters = case["params"]
    gains = {f"{key[0]}_{key[1]}": parameters[key] for key in _GAINS if key in parameters}
    # The reference states the weight, a config the acceleration.
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
def paper_run(variant: str, weighed: bool, engine: str) -> Result:
    """The run of a paper's case at the default tolerances and samples. Not to be written to."""
    result = rbstab.simulate(paper_config(variant, weighed, engine=engine))
    for variable in result.variables.values():
        variable.data.flags.writeable = False
    return result


LOOSE_TOLERANCES = (1e-4, 1e-6, 1e-8)


@functools.cache
def loose_run(engine: str, rtol: float, method: str = "DOP853") -> Result:
    """Half a second of the body on its visco-elastic connector, under gravity, less exactly."""
    choice = {} if engine == "heyoka" else {"method": method, "atol": rtol}
    sampling = {"duration": 0.5, "samples": 6}
    config = paper_config("visco-elastic", True, engine=engine, rtol=rtol, **sampling, **choice)
    return rbstab.simulate(config)


def paper_matrix(variant: str, name: str) -> Array:
    """A diagonal parameter of a case as a matrix."""
    return np.diag(reference_case(variant, weighed=False)["params"][name])
