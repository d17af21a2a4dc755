"""Each bound of a number or a text is where the documentation says: the next value is refused."""

import math

import pytest
from support.configs import edited, plain

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config

SLIDING = edited("variant: visco-elastic", "variant: sliding")
SLIDING = "".join(f"{line}\n" for line in SLIDING.splitlines() if "_c:" not in line)
SLIDING = edited("  K_t:", "  K_s: [1, 2, 3]\n  surface: position\n  K_t:", SLIDING)


def config_with(path, value, text):
    *sections, key = path.split(".")
    data = place = plain(text)
    for section in sections:
        place = place.setdefault(section, {})
    place[key] = value
    if sections == ["reference"] and key != "source":
        place["source"] = "a"
    return data


ABOVE_ONE = math.nextafter(1.0, 2.0)

BOUNDS = [
    ("title", "x" * 200, "x" * 201),
    ("title", "x", ""),
    ("reference.source", "x" * 200, "x" * 201),
    ("reference.source", "x", ""),
    ("reference.note", "x" * 1000, "x" * 1001),
    ("body.mass", 5e-324, 0.0),
    ("integration.duration", 1e-90, 0.0),
    ("integration.samples", 2, 1),
    ("integration.samples", 1_000_000, 1_000_001),
    ("integration.rtol", 0.1, math.nextafter(0.1, 1)),
    ("integration.rtol", 2.3e-14, 2.2e-14),
    ("integration.atol", 1.0, ABOVE_ONE),
    ("integration.atol", 5e-324, 0.0),
    ("integration.range_bound", math.nextafter(1.0, 0.0), 1.0),
    ("integration.range_bound", 5e-324, 0.0),
    ("integration.step_limit", 1, 0),
    ("integration.time_limit", 5e-324, 0.0),
    ("controller.switch_limit", 1, 0),
    ("controller.stored_switches", 0, -1),
    ("controller.stick_energy", 0.0, -5e-324),
    ("controller.stick_energy", 1e308, math.inf),
    ("controller.surface", {"slope": 5e-324}, {"slope": 0.0}),
    ("controller.law", {"boundary_layer": 5e-324}, {"boundary_layer": 0.0}),
    ("controller.law", {"implicit": 5e-324}, {"implicit": 0.0}),
]


@pytest.mark.parametrize(("path", "allowed", "refused"), BOUNDS)
def test_the_last_value_is_allowed_and_the_next_is_refused(path, allowed, refused):
    load_config(config_with(path, allowed, SLIDING))
    with pytest.raises(ConfigError) as caught:
        load_config(config_with(path, refused, SLIDING))
    (problem,) = caught.value.problems
    assert problem.key.startswith(path)


def test_the_smallest_tolerance_of_the_compiled_engine():
    data = config_with("integration.engine", "heyoka", SLIDING)
    data["integration"]["rtol"] = 1e-16
    assert load_config(data).integration.rtol == 1e-16
    data["integration"]["rtol"] = 0.9e-16
    with pytest.raises(ConfigError, match="expected a number at least 1e-16"):
        load_config(data)


def test_notes_may_be_empty():
    config = load_config(config_with("reference.note", "", SLIDING))
    assert config.reference is not None
    assert config.reference.note == ""
