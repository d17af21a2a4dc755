"""Results of made up runs: every number is known in closed form."""

from typing import Any

import numpy as np
import yaml

from rbstab.config.load import load_config, resolved_yaml, run_id
from rbstab.store.result import Result, write_result
from rbstab.store.variables import Variable
from rbstab.systems.quantities import BY_NAME
from support.configs import VISCO_ELASTIC, plain

DECAY = 8.0
"""1/s: v = V_START exp(-DECAY t)."""

V_START = 5000.0

PEAKS = (-0.05, 0.02, 0.04)
"""m: the extreme contact displacement of each axis, reached between two samples."""

LARGEST_PITCH = 0.75
"""rad: the largest |θ2|, at the start."""

RESIDUAL = 2e-9
"""J: the largest |r|."""

CHECKS = ("audit", "decrease", "damping", "positive", "derivative", "global stability")
REGION = "certified region"

PARTS = ("kinetic", "gravity", "translational stabilizer", "rotational stabilizer", "connector")


def made_config(*changes, text=VISCO_ELASTIC, **more):
    """Return the resolved YAML config of a made up run; `more` are further keys."""
    return resolved_yaml(load_config({**plain(text), **more}, changes))


def made_result(config=None, *, verdicts=None, level=(np.nan, np.nan), **attributes):
    """Return a made up result.

    Args:
        config: Its resolved config, YAML.
        verdicts: The verdicts of certificate checks that are not "consistent".
        level: v(0) and the bound in the check of the certified region.
        attributes: Attributes that replace the default ones.
    """
    text = made_config() if config is None else config
    arrays = {name: data.copy() for name, data in _arrays().items()}
    variables = {
        name: Variable(
            BY_NAME[name].dimensions,
            data,
            BY_NAME[name].unit,
            f"{BY_NAME[name].symbol}: {BY_NAME[name].meaning}",
        )
        for name, data in arrays.items()
    }
    variables |= {
        "axis": Variable(("axis",), np.array([1, 2, 3]), "1", "component of a vector"),
        "part": Variable(("part",), np.array(PARTS, dtype=object), "1", "part of the system"),
    }
    words = {**dict.fromkeys(CHECKS, "consistent"), REGION: "unknown", **(verdicts or {})}
    lines: dict[str, list[Any]] = {
        "check": list(words),
        "verdict": list(words.values()),
        "value": [1e-12] * len(CHECKS) + [level[0]],
        "bound": [1e-8] * len(CHECKS) + [level[1]],
        "when": [0.5] * len(CHECKS) + [np.nan],
        "quantity": ["max |r| / largest energy"] * len(words),
    }
    for name, column in lines.items():
        kind = object if isinstance(column[0], str) else float
        data = np.array(column, dtype=kind)
        variables[f"certificate/{name}"] = Variable(("check",), data, "1", name)
    return Result(variables, {**_attributes(text), **attributes}, text)


def made_file(path, config=None, **more):
    """Write a made up result to a file and return its path."""
    write_result(path, made_result(config, **more))
    return path


def _arrays():
    t = np.linspace(0.0, 2.0, 401)
    # |E| is largest at t = 0.9975, half way between two samples.
    phase, rate = 0.5 * np.pi * (t + 0.0025), 0.5 * np.pi
    E, F = np.outer(np.sin(phase), PEAKS), rate * np.outer(np.cos(phase), PEAKS)
    zero = np.zeros((len(t), 3))
    Theta, Omega = zero.copy(), zero.copy()
    # With θ1 = θ3 = 0, dθ2/dt is the angular velocity about the second axis.
    Theta[:, 1] = LARGEST_PITCH * np.cos(3 * t)
    Omega[:, 1] = -3 * LARGEST_PITCH * np.sin(3 * t)
    v = V_START * np.exp(-DECAY * t)
    energy = np.zeros((len(t), len(PARTS)))
    energy[:, 0] = v
    dissipation = np.zeros_like(energy)
    dissipation[:, 3] = DECAY * v
    vectors = dict.fromkeys(
        ("velocity", "contact_force", "stabilizing_force", "stabilizing_couple"), zero
    )
    return vectors | {
        "time": t,
        "orientation": Theta,
        "angular_velocity": Omega,
        "position": E,
        "contact_displacement": E,
        "contact_velocity": F,
        "lyapunov": v,
        "lyapunov_rate": -DECAY * v,
        "lyapunov_change": v - V_START,
        "energy": energy,
        "dissipation": dissipation,
        "energy_residual": RESIDUAL * np.sin(np.pi * t / 4),
        "energy_at_rest": np.array(0.0),
        "energy_round_off": np.array(np.finfo(float).tiny),
        "rest_orientation": Theta[-1],
        "rest_position": E[-1],
        "peak_contact_displacement": np.array(PEAKS),
        "peak_distance": np.array(np.linalg.norm(PEAKS)),
        "largest_pitch": np.array(LARGEST_PITCH),
        "peak_contact_displacement_error": np.zeros(3),
        "peak_distance_error": np.array(0.0),
        "largest_pitch_error": np.array(0.0),
        "settling_time": np.array(np.log(1000) / DECAY),
        "settling_time_error": np.array(0.0),
    }


def _attributes(config):
    data = yaml.safe_load(config)
    try:
        identity = run_id(load_config(data))
    except ValueError:
        identity = "0" * 32
    return {
        "title": str(data.get("title", "")),
        "variant": str(data.get("controller", {}).get("variant", "")),
        "status": "completed",
        "status_detail": "",
        "warnings": "",
        "verdict": "consistent",
        "lyapunov_zero": "the rest state that the motion approaches; no lower one is known",
        "run_id": identity,
        "engine": "scipy",
        "steps": 200,
        "wall_time": 0.25,
        "rbstab_version": "0.1.0",
        "commit": "c" * 40,
        "created": "2026-01-01T00:00:00+00:00",
    }
