"""A valid config of each variant, and edited copies of it."""

from typing import Any

import pytest
import yaml

from rbstab.config.errors import ConfigError

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
"""Tests of error locations rely on the line numbers: add new lines at the end."""

PLAN = """\
title: Plan
base: visco-elastic.yaml
vary:
  body.mass: {values: [40, 50]}
design: grid
keep: summary
"""
"""A plan of two members, beside the config in `visco-elastic.yaml`."""

_CONNECTOR = "  K_c: [12300, 12300, 9840]\n  L_c: [600, 600, 420]\n"
_OWN_STATE = "  K_d: [12300, 12300, 9840]\n  L_d: [1200, 1200, 840]\n"


def edited(old, new, text=VISCO_ELASTIC):
    """Return the text with its one occurrence of `old` replaced."""
    assert text.count(old) == 1, f"{old!r} occurs {text.count(old)} times"
    return text.replace(old, new)


FREE = edited(_CONNECTOR, "", edited("visco-elastic", "free"))
PERMANENT = edited(_CONNECTOR, "", edited("visco-elastic", "permanent"))
EMBEDDED = edited(_CONNECTOR, _CONNECTOR + _OWN_STATE, edited("visco-elastic", "embedded"))

SLIDING = edited(
    _CONNECTOR, "  K_s: [1, 2, 3]\n  surface: position\n", edited("visco-elastic", "sliding")
)
MANIFOLD = edited("samples: 11", "samples: 11\n  coordinates: manifold", PERMANENT)

BY_VARIANT = {
    "free": FREE,
    "permanent": PERMANENT,
    "visco-elastic": VISCO_ELASTIC,
    "embedded": EMBEDDED,
}


def plain(text=VISCO_ELASTIC):
    """Return a config as new plain data, parsed by PyYAML and not by the program."""
    data: dict[str, Any] = yaml.safe_load(text)
    return data


SOLVER_DEFAULTS: dict[str, Any] = {
    "engine": "scipy",
    "method": "DOP853",
    "rtol": 1e-12,
    "atol": 1e-12,
    "range_bound": 1e-3,
    "step_limit": 1_000_000,
    "time_limit": 600.0,
}
"""The documented defaults of the section `integration`, for every variant."""


def messages_of(load, path, changes):
    """Load a wrong file with changes, and return the messages of its ConfigError, one a problem."""
    with pytest.raises(ConfigError) as caught:
        load(path, changes)
    messages = str(caught.value).splitlines()
    assert messages == [str(problem) for problem in caught.value.problems]
    return messages
