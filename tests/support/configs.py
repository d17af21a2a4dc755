"""A config that is right, for each variant, and what comes of it when a part is replaced."""

from typing import Any

import yaml

VISCO_ELASTIC = """\
title: Case
body:
  mass: 41.0
  inertia: [10.0, 8.0, 0.4]
  contact_point: [0.15, 0.10, -0.42]
controller:
  variant: visco-elastic
  K_t: [4100, 4100, 3280]
  L_t: [200, 200, 140]
  K_r: [400, 400, 320]
  L_r: [60, 60, 42]
  K_c: [12300, 12300, 9840]
  L_c: [600, 600, 420]
initial:
  orientation: [0, 0, 0]
  angular_velocity: [16, 32, -16]
integration:
  duration: 2.0
  samples: 11
"""
"""Line numbers matter to the tests of locations: add new lines at the end."""

_CONNECTOR = "  K_c: [12300, 12300, 9840]\n  L_c: [600, 600, 420]\n"
_OWN_STATE = "  K_d: [12300, 12300, 9840]\n  L_d: [1200, 1200, 840]\n"


def edited(old: str, new: str, text: str = VISCO_ELASTIC) -> str:
    """The text with its one occurrence of `old` replaced."""
    assert text.count(old) == 1, f"{old!r} is not there once"
    return text.replace(old, new)


FREE = edited(_CONNECTOR, "", edited("visco-elastic", "free"))
PERMANENT = edited(_CONNECTOR, "", edited("visco-elastic", "permanent"))
EMBEDDED = edited(_CONNECTOR, _CONNECTOR + _OWN_STATE, edited("visco-elastic", "embedded"))

BY_VARIANT = {
    "free": FREE,
    "permanent": PERMANENT,
    "visco-elastic": VISCO_ELASTIC,
    "embedded": EMBEDDED,
}


def plain(text: str = VISCO_ELASTIC) -> dict[str, Any]:
    """The same as plain data, fresh at every call; read by another reader than the program's."""
    data: dict[str, Any] = yaml.safe_load(text)
    return data
