"""A loaded config cannot be changed, and it contains all defaults."""

from typing import Any

import pytest
from pydantic import BaseModel, ValidationError
from support.configs import BY_VARIANT, PERMANENT, SOLVER_DEFAULTS, VISCO_ELASTIC

from rbstab.config.section import FrozenMapping


def sections(model, path=""):
    yield path, model
    for name in type(model).model_fields:
        value = getattr(model, name)
        if isinstance(value, BaseModel):
            yield from sections(value, f"{path}.{name}")


REFERENCE = "reference: {source: a, final: {velocity: [1, 2, 3]}}\n"
CONFIGS = [
    *(text + REFERENCE for text in BY_VARIANT.values()),
    PERMANENT + "  coordinates: manifold\n  drift_control: {baumgarte: 5}\n",
]


@pytest.mark.parametrize("text", CONFIGS)
def test_no_value_can_be_assigned(load, text):
    config = load(text)
    before = config.model_dump_json()
    for _, section in sections(config):
        for name in type(section).model_fields:
            with pytest.raises(ValidationError):
                setattr(section, name, getattr(section, name))
        with pytest.raises(ValidationError):
            section.anything = 1
    assert config.model_dump_json() == before


@pytest.mark.parametrize("text", CONFIGS)
def test_lists_are_tuples_to_the_bottom(load, text):
    def check(value):
        assert not isinstance(value, list | dict | set) or isinstance(value, FrozenMapping)
        if isinstance(value, tuple):
            for entry in value:
                check(entry)

    for _, section in sections(load(text)):
        for name in type(section).model_fields:
            check(getattr(section, name))


def test_matrices_are_tuples_of_tuples_of_floats(load):
    config = load(VISCO_ELASTIC, "body.inertia=[[3, 1, 0], [1, 3, 0], [0, 0, 3]]")
    assert config.body.inertia == ((3.0, 1.0, 0.0), (1.0, 3.0, 0.0), (0.0, 0.0, 3.0))
    assert all(type(x) is float for row in config.body.inertia for x in row)


def test_equal_configs_have_one_hash(load):
    assert hash(load(VISCO_ELASTIC)) == hash(load(VISCO_ELASTIC))
    assert load(VISCO_ELASTIC) == load(VISCO_ELASTIC)
    assert load(VISCO_ELASTIC) != load(VISCO_ELASTIC, "body.mass=42")


ZERO = (0.0, 0.0, 0.0)

INTEGRATION: dict[str, Any] = {"samples": 401, **SOLVER_DEFAULTS}

DEFAULTS: dict[str, dict[str, Any]] = {
    "free": {"position": ZERO, "velocity": ZERO, "coordinates": "Z"},
    "permanent": {"coordinates": "reduced", "drift_control": "none", "anchor": "origin"},
    "visco-elastic": {
        "position": ZERO,
        "velocity": ZERO,
        "coordinates": "Z",
        "anchor": "origin",
    },
    "embedded": {
        "position": ZERO,
        "velocity": ZERO,
        "connector_state": ZERO,
        "coordinates": "Z",
        "anchor": "origin",
    },
}


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_defaults(load, variant):
    lines = BY_VARIANT[variant].splitlines()
    kept = [x for x in lines if not x.startswith(("title", "initial", "  orient", "  angular"))]
    config = load("\n".join(x for x in kept if "samples" not in x))
    assert config.schema_version == 1
    assert config.title == "untitled"
    assert config.gravity == ZERO
    assert config.reference is None
    assert (config.initial.orientation, config.initial.angular_velocity) == (ZERO, ZERO)
    found = config.integration.model_dump() | config.initial.model_dump()
    found |= config.controller.model_dump()
    expected = DEFAULTS[variant] | INTEGRATION
    assert {key: found.get(key) for key in expected} == expected


def test_values_of_the_file_are_kept(load):
    config = load(VISCO_ELASTIC)
    assert config.title == "Case"
    assert config.body.mass == 41.0
    assert config.body.inertia == (10.0, 8.0, 0.4)
    assert config.body.contact_point == (0.15, 0.10, -0.42)
    assert config.controller.variant == "visco-elastic"
    assert config.controller.K_t == (4100.0, 4100.0, 3280.0)
    assert config.controller.L_t == (200.0, 200.0, 140.0)
    assert config.controller.K_r == (400.0, 400.0, 320.0)
    assert config.controller.L_r == (60.0, 60.0, 42.0)
    assert config.controller.K_c == (12300.0, 12300.0, 9840.0)
    assert config.controller.L_c == (600.0, 600.0, 420.0)
    assert config.initial.angular_velocity == (16.0, 32.0, -16.0)
    assert config.integration.duration == 2.0
    assert config.integration.samples == 11
