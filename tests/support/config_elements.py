"""Configs with elements: one of each kind, beside any controller or none."""

from copy import deepcopy
from typing import Any

import numpy as np

STRUT: dict[str, Any] = {
    "kind": "spring",
    "point": [0.02, 0.0, 0.3],
    "anchor": [0.0, 0.01, 1.4],
    "stiffness": 900.0,
    "rest_length": 0.8,
    "damping": 40.0,
}
TIE: dict[str, Any] = {
    "kind": "visco-elastic",
    "point": [0.0, 0.2, 0.0],
    "anchor": [0.0, 0.25, 0.01],
    "K_c": [[1000.0, 100.0, 0.0], [100.0, 1200.0, -50.0], [0.0, -50.0, 2000.0]],
    "L_c": [30.0, 30.0, 12.0],
}
UPRIGHT: dict[str, Any] = {"kind": "attitude", "K": [400.0, 300.0, 320.0], "L": [20.0, 20.0, 12.0]}
RANGE: dict[str, Any] = {
    "kind": "guard",
    "method": "barrier",
    "stiffness": 10.0,
    "outer_stiffness": 2.0,
}
EACH_KIND = {"range": RANGE, "strut": STRUT, "tie": TIE, "upright": UPRIGHT}

BAND: dict[str, Any] = {
    "kind": "ligament",
    "point": [0.1, 0.2, 0.3],
    "anchor": [0.5, 0.1, 0.5],
    "stiffness": 100.0,
    "slack_length": 0.3,
    "toe_strain": 0.2,
    "damping": 8.0,
}

CONTROLLER: dict[str, Any] = {
    "variant": "free",
    "K_t": [4100.0, 4100.0, 3280.0],
    "L_t": [200.0, 200.0, 140.0],
    "K_r": [400.0, 400.0, 320.0],
    "L_r": [60.0, 60.0, 42.0],
}

HELD = CONTROLLER | {"variant": "permanent"}


def guard(method, **numbers):
    """Return a guard."""
    return {"kind": "guard", "method": method, **numbers}


YAML = """\
schema_version: 2
body: {mass: 41, inertia: [10, 8, 9], contact_point: [0.15, 0.10, -0.42]}
elements:
  strut:
    kind: spring
    point: [0.02, 0, 0.3]
    anchor: [0, 0.01, 1.4]
    stiffness: 900
    rest_length: 0.8
  upright: {kind: attitude, K: [400, 400, 320], L: [60, 60, 42]}
integration: {duration: 2}
"""
"""Tests of error locations rely on the line numbers."""


def config_data(elements=None, controller=CONTROLLER, **changes):
    """Return a config of schema version 2 as new plain data.

    Args:
        elements: The elements by name; by default one of each kind.
        controller: The section; None for a config without it.
        changes: Other sections, whose entries replace those here.
    """
    data: dict[str, Any] = {
        "schema_version": 2,
        "title": "Elements",
        "body": {"mass": 41.0, "inertia": [10.0, 8.0, 9.0], "contact_point": [0.15, 0.1, -0.42]},
        "gravity": [0.0, 0.0, -9.81],
        "elements": EACH_KIND if elements is None else elements,
        "initial": {"orientation": [0.1, 0.2, 0.3], "angular_velocity": [1.0, 0.5, -0.7]},
        "integration": {"duration": 0.5, "samples": 21},
    }
    if controller is not None:
        data["controller"] = controller
    for name, section in changes.items():
        data[name] = data[name] | section if isinstance(section, dict) else section
    return deepcopy(data)


def random_elements(rng, count):
    """Return random elements of random kinds; the springs are too long to be pressed to a point."""

    def vector(scale):
        return (scale * rng.normal(size=3)).tolist()

    def matrix(scale):
        root = rng.normal(size=(3, 3))
        positive = scale * (root @ root.T + np.eye(3))
        return ((positive + positive.T) / 2).tolist()

    def number(low, high):
        return float(rng.uniform(low, high))

    def strut():
        direction = rng.normal(size=3)
        anchor = 3 * direction / np.linalg.norm(direction)
        constants = {"stiffness": number(50, 300), "rest_length": number(2, 3.5)}
        ends = {"point": vector(0.2), "anchor": anchor.tolist()}
        return {"kind": "spring", **ends, **constants, "damping": number(0, 40)}

    def tie():
        ends = {"point": vector(0.3), "anchor": vector(0.3)}
        return {"kind": "visco-elastic", **ends, "K_c": matrix(200), "L_c": matrix(20)}

    def upright():
        return {"kind": "attitude", "K": matrix(40), "L": matrix(4)}

    def barrier():
        sizes = {"stiffness": number(1, 30), "outer_stiffness": number(0, 5)}
        return guard("barrier", **sizes)

    made = rng.choice(np.array([strut, tie, upright, barrier], dtype=object), size=count)
    return {f"e{index}": make() for index, make in enumerate(made)}
