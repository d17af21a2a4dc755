"""Each bound of a number or a text is where the documentation says: the next value is refused."""

import json
import math

import pytest
from support.config_elements import UPRIGHT
from support.configs import SLIDING, plain

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config

MANY = {f"e{number}": UPRIGHT for number in range(101)}
HUNDRED = {name: MANY[name] for name in list(MANY)[1:]}

# A key, the last value that is allowed, and the next one.
BOUNDS = [
    ("title", "x" * 200, "x" * 201),
    ("title", "x", ""),
    ("reference.source", "x" * 200, "x" * 201),
    ("reference.source", "x", ""),
    ("reference.note", "", 5),
    ("reference.note", "x" * 1000, "x" * 1001),
    ("body.mass", 5e-324, 0.0),
    ("integration.duration", 1e-90, 0.0),
    ("integration.samples", 2, 1),
    ("integration.samples", 1_000_000, 1_000_001),
    ("integration.rtol", 0.1, math.nextafter(0.1, 1)),
    ("integration.rtol", 2.3e-14, 2.2e-14),
    ("integration", *({"duration": 1, "engine": "heyoka", "rtol": x} for x in (1e-16, 0.9e-16))),
    ("integration.atol", 1.0, math.nextafter(1.0, 2.0)),
    ("integration.atol", 5e-324, 0.0),
    ("integration.range_bound", math.nextafter(1.0, 0.0), 1.0),
    ("integration.range_bound", 5e-324, 0.0),
    ("integration.step_limit", 1, 0),
    ("integration.time_limit", 5e-324, 0.0),
    ("controller.switch_limit", 1, 0),
    ("controller.stored_switches", 0, -1),
    ("controller.stick_energy", 0.0, -5e-324),
    ("controller.stick_energy", 1e308, 1e999),
    ("controller.surface", {"slope": 5e-324}, {"slope": 0.0}),
    ("controller.law", {"boundary_layer": 5e-324}, {"boundary_layer": 0.0}),
    ("controller.law", {"implicit": 5e-324}, {"implicit": 0.0}),
    ("elements", HUNDRED, MANY),
]


@pytest.mark.parametrize(("key", "allowed", "refused"), BOUNDS)
def test_the_last_value_is_allowed_and_the_next_is_refused(key, allowed, refused):
    data = plain(SLIDING) | {"schema_version": 2, "reference": {"source": "a"}}
    load_config(data, [f"{key}={json.dumps(allowed)}"])
    with pytest.raises(ConfigError) as caught:
        load_config(data, [f"{key}={json.dumps(refused).replace('Infinity', '.inf')}"])
    (problem,) = caught.value.problems
    assert problem.key.startswith(key)
