"""Derivatives by differences of runs, which take long, in `tests/data/differences.json`.

Run as a script, it computes them again: `PYTHONPATH=tests .venv/bin/python -m
support.stored_differences`. `support.outcomes` has the method; no code of the sensitivities takes
part, except that it names the entries and quantities, and says near which times to look for peaks.
"""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.experiment.tuning.sensitivities import sensitivities
from support.outcomes import SMOOTH, SWITCHING, differences
from support.paper_runs import paper_config

FILE = Path(__file__).parents[1] / "data" / "differences.json"

GRAVITY = [1.0, 2.0, -10.0]

START = {
    "orientation": [0.2, -0.1, 0.15],
    "angular_velocity": [9.0, 14.0, -8.0],
    "position": [0.03, -0.02, 0.04],
    "velocity": [0.4, -0.3, 0.5],
}
HELD_START = {key: START[key] for key in ("orientation", "angular_velocity")}
EMBEDDED_START = START | {"connector_state": [0.01, 0.02, -0.01]}

FULL_GAINS = {
    "K_t": [[4100, 600, 0], [600, 4100, -300], [0, -300, 3280]],
    "L_t": [[200, 30, 0], [30, 200, 0], [0, 0, 140]],
    "K_r": [[400, 50, 20], [50, 400, 0], [20, 0, 320]],
    "L_r": [[60, 5, 0], [5, 60, 0], [0, 0, 42]],
    "K_c": [[12300, -2000, 0], [-2000, 12300, 1000], [0, 1000, 9840]],
    "L_c": [[600, 0, 90], [0, 600, 0], [90, 0, 420]],
    "K_d": [[12300, 0, 500], [0, 12300, 0], [500, 0, 9840]],
    "L_d": [[1200, 100, 0], [100, 1200, 0], [0, 0, 840]],
}


def config(variant, start, *, controller=None, duration=1.2, **integration):
    """Return the config of a case."""
    data = paper_config(variant, controller=controller, duration=duration, **integration)
    data["gravity"] = GRAVITY
    data["initial"] = copy.deepcopy(start)
    return data


ELEMENTS: dict[str, dict[str, Any]] = {
    "ligament": {
        "kind": "ligament",
        "point": [0.02, 0.0, -0.4],
        "anchor": [0.1, 0.01, -0.3],
        "slack_length": 0.1,
        "stiffness": 5000.0,
        "toe_strain": 0.03,
        "damping": 20.0,
    },
    "stiff": {"kind": "guard", "method": "stiff", "soft_angle": 0.12, "stiffness": 500.0},
    "repelling": {"kind": "guard", "method": "repelling", "soft_angle": 0.15, "couple": 50.0},
    "stop": {"kind": "guard", "method": "stop", "angle": 0.2, "restitution": 0.5},
    "tie": {
        "kind": "sliding",
        "point": [0.1, 0.02, -0.1],
        "anchor": [0.0, 0.05, 0.1],
        "K_s": [600.0, 500.0, 400.0],
        "surface": {"slope": 20.0},
    },
}

SLIDING = {"variant": "sliding", "K_s": [3000.0, 2500.0, 2000.0]}


def load(signal):
    """Return an input whose load changes with a signal."""
    at = {"quantity": "force", "point": [0.01, 0.02, 0.2], "direction": [1.0, 0.2, -0.3]}
    return {"kind": "input", **at, "amplitude": 200.0, "signal": signal}


def with_elements(elements, **given):
    """Return the config of a case with elements."""
    return config("free", START, **given) | {"schema_version": 2, "elements": elements}


SMOOTH_CASES = {
    "visco-elastic-W-equilibrium": config(
        "visco-elastic", START, controller={"anchor": "equilibrium"}, coordinates="W"
    ),
    "permanent-equilibrium": config("permanent", HELD_START, controller={"anchor": "equilibrium"}),
    "free": config("free", START, duration=1.5),
    "free-W": config("free", START, duration=1.5, coordinates="W"),
    "visco-elastic-Z-origin": config("visco-elastic", START),
    "embedded": config("embedded", EMBEDDED_START),
    "embedded-full-gains": config(
        "embedded", EMBEDDED_START, controller={**FULL_GAINS, "anchor": "equilibrium"}
    ),
}

SWITCHING_CASES = {
    "ligament": with_elements({"ligament": ELEMENTS["ligament"]}, duration=1.5),
    "guards": with_elements(
        {name: ELEMENTS[name] for name in ("stiff", "repelling")}, duration=1.6
    ),
    "stop": with_elements({"stop": ELEMENTS["stop"]}, duration=1.6),
    # It hops, and then rests against the stop.
    "rest": {
        "schema_version": 2,
        "body": {"mass": 1.5, "inertia": [0.02, 0.1, 0.1], "contact_point": [-0.14, 0.02, 0.01]},
        "gravity": [0.5, 0.3, -9.81],
        "controller": {
            "variant": "permanent",
            "K_t": [2.0, 2.0, 2.0],
            "L_t": [0.1, 0.1, 0.1],
            "K_r": [3.0, 0.5, 3.0],
            "L_r": [0.4, 0.05, 0.4],
        },
        "elements": {"bone": ELEMENTS["stop"]},
        "initial": {"orientation": [0.1, -0.15, 0.2], "angular_velocity": [1.0, 0.2, 0.5]},
        "integration": {"duration": 3.0},
    },
    # It rests against the stop, while axes of the tie slide.
    "landed": with_elements(
        {
            "stop": ELEMENTS["stop"],
            "tie": ELEMENTS["tie"] | {"K_s": [3000.0, 2500.0, 2000.0], "anchor": [0.1, 0.02, -0.1]},
            "lean": {
                "kind": "input",
                "quantity": "couple",
                "direction": [0.0, 1.0, 0.0],
                "amplitude": 300.0,
                "signal": {"kind": "constant"},
            },
        },
        duration=1.0,
    ),
    "tie": with_elements({"tie": ELEMENTS["tie"]}, duration=1.6),
    "slope": config("free", START, controller=SLIDING | {"surface": {"slope": 20.0}}),
    "layer": config(
        "free",
        START,
        controller=SLIDING | {"surface": "position", "law": {"boundary_layer": 0.01}},
        duration=1.6,
    ),
    "inputs": with_elements(
        {
            "ligament": ELEMENTS["ligament"],
            "pulse": load({"kind": "pulse", "start": 0.2, "duration": 0.13}),
            # It begins together with the pulse.
            "ramp": load({"kind": "ramp", "start": 0.2, "duration": 0.3}),
            "noise": load({"kind": "noise", "seed": 1, "rate": 49.0, "correlation_time": 0.2}),
        },
        duration=0.6,
    ),
}
"""Configs whose elements switch, or whose inputs are made of legs."""

CASES = SMOOTH_CASES | SWITCHING_CASES

METHODS = dict.fromkeys(SMOOTH_CASES, SMOOTH) | dict.fromkeys(SWITCHING_CASES, SWITCHING)
# Many numbers hardly matter once the body rests; a longer step shows more digits of their effect.
METHODS["rest"] = SWITCHING._replace(step=1e-4)

CASES["embedded-full-gains"]["body"]["inertia"] = [[10, 0.6, -0.4], [0.6, 8, 0.5], [-0.4, 0.5, 3]]


def stored_differences(name, derived):
    """Return the stored derivatives of a case, for the entries and quantities that were found.

    Shape (entries, quantities).
    """
    stored = json.loads(FILE.read_text(encoding="utf-8"))[name]
    # The derivatives of another config would be of no use.
    assert stored["config"] == CASES[name]
    assert stored["entries"] == [entry.key for entry in derived.entries]
    assert stored["quantities"] == [quantity.name for quantity in derived.quantities]
    return np.array(stored["derivatives"])


def main():
    """Compute the derivatives of all cases, and store them."""
    lines = []
    for name, data in CASES.items():
        derived = sensitivities(data)
        case = {
            "config": data,
            "entries": [entry.key for entry in derived.entries],
            "quantities": [quantity.name for quantity in derived.quantities],
            "derivatives": differences(data, derived, METHODS[name]).tolist(),
        }
        lines.append(f"{json.dumps(name)}: {json.dumps(case)}")
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
