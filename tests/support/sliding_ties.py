"""Sliding ties for tests: one tie, a tie in the place of a sliding controller, and two together."""

from pathlib import Path
from typing import Any

import yaml

from support.switching import data

ROOT = Path(__file__).parents[2]


def tie(point=(0.0, 0.0, 0.0), force=30.0, surface="position", **changes):
    ends = {"point": list(point), "anchor": list(point)}
    return {"kind": "sliding", **ends, "K_s": [force] * 3, "surface": surface} | changes


def as_tie(config):
    """Return a config whose sliding controller is a tie at the contact point."""
    settings, R = config["controller"], config["body"]["contact_point"]
    keys = ("K_s", "surface", "law")
    element = {key: settings[key] for key in keys if key in settings}
    element |= {"kind": "sliding", "point": R, "anchor": R}
    stabilizers = {key: settings[key] for key in ("K_t", "L_t", "K_r", "L_r")}
    return config | {
        "schema_version": 2,
        "controller": {"variant": "free"} | stabilizers,
        "elements": {"tie": element},
    }


def sliding_example(name, **integration):
    path = ROOT / f"configs/examples/sliding/{name}.yaml"
    config = yaml.safe_load(path.read_text(encoding="utf-8"))
    config["integration"] |= {"duration": 0.5, "samples": 51} | integration
    return config


TWO = {
    "a": tie([0.15, 0.1, -0.42], 3000.0, {"slope": 20.0}),
    "b": tie([-0.2, 0.1, 0.3], 2000.0, {"slope": 10.0}),
}
BODY = {"mass": 41.0, "inertia": [10.0, 8.0, 9.0], "contact_point": [0.15, 0.1, -0.42]}
CONTROLLER: dict[str, Any] = {"variant": "free", "K_t": [4100.0] * 3, "L_t": [200.0] * 3}
CONTROLLER |= {"K_r": [400.0] * 3, "L_r": [60.0] * 3}


def several(elements, controller=CONTROLLER, **integration):
    return data(
        elements,
        {"angular_velocity": [4.0, -6.0, 3.0]},
        {"duration": 0.4, "samples": 21} | integration,
        body=BODY,
        controller=controller,
        gravity=[0.0, 0.0, -9.81],
    )
