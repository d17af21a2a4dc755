"""The JSON Schema for editors accepts and refuses the same configs as the program."""

import pytest
from support.configs import BY_VARIANT, EMBEDDED, FREE, PERMANENT, VISCO_ELASTIC, edited
from support.json_schemas import schema_errors, validator_of

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.config.schema import NO_VARIANT, VARIANTS, json_schema

MANIFOLD = PERMANENT + "  coordinates: manifold\n"

ACCEPTED = [
    *BY_VARIANT.values(),
    VISCO_ELASTIC + "gravity: [0, 0, -9.81]\nschema_version: 1\n",
    VISCO_ELASTIC + "  engine: heyoka\n  coordinates: W\n  method: Radau\n  atol: 1\n",
    VISCO_ELASTIC + "reference:\n",
    VISCO_ELASTIC + "reference: {source: a, note: b, final: {position: [1, 2, 3]}}\n",
    edited("[60, 60, 42]", "[[60, 1, 0], [1, 60, 0], [0, 0, 42]]"),
    edited("title: Case\n", ""),
    edited("  samples: 11\n", ""),
    edited("  K_t:", "  anchor: equilibrium\n  K_t:", EMBEDDED),
    edited("initial:", "initial:\n  connector_state: [1, 2, 3]", EMBEDDED),
    edited("  L_r: [60, 60, 42]\n", ""),
    edited("L_r: [60, 60, 42]", "L_r: 0"),
    edited("L_r: [60, 60, 42]", "L_r: [60, 0, 42]"),
    MANIFOLD + "  drift_control: none\n",
    MANIFOLD + "  drift_control: projection\n",
    MANIFOLD + "  drift_control: {baumgarte: 5}\n",
    FREE + "  range_bound: 0.5\n  step_limit: 1\n  time_limit: 1e-3\n  rtol: 0.1\n",
]


@pytest.fixture(scope="module")
def validator():
    schema = json_schema()
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    return validator_of(schema)


@pytest.mark.parametrize("text", ACCEPTED)
def test_both_accept(validator, load, text):
    load(text)
    assert schema_errors(validator, text) == []


def _objects(node, path="$"):
    """Yield the path and the schema of each object; parts of conditions are none."""
    if isinstance(node, dict):
        if "properties" in node and node.get("type") == "object":
            yield path, node
        for key, value in node.items():
            yield from _objects(value, f"{path}.{key}")
    elif isinstance(node, list):
        for index, value in enumerate(node):
            yield from _objects(value, f"{path}[{index}]")


# Their names, or the values they may have, explain them.
SELF_EXPLAINING = {
    "schema_version",
    "title",
    "variant",
    "kind",
    "method",
    "source",
    "note",
    "final",
}
SELF_EXPLAINING |= {"coordinates", "engine", "rtol", "step_limit", "switch_limit"}
OF_FINAL_STATE = {"orientation", "angular_velocity", "position", "velocity"}


def test_every_number_says_what_it_is():
    schema = json_schema()
    without = {
        key
        for path, node in _objects(schema)
        for key, value in node["properties"].items()
        if "description" not in value
        and "$ref" not in str(value)
        and not (path.endswith("FinalState") and key in OF_FINAL_STATE)
    }
    assert without <= SELF_EXPLAINING


def test_every_section_says_what_it_is_and_takes_no_other_keys():
    objects = dict(_objects(json_schema()))
    assert len(objects) > 10
    for path, node in objects.items():
        assert node.get("description"), path
        assert not node["description"].strip().endswith(":"), path
        assert node["additionalProperties"] is False, path


def test_every_variant_is_in_the_schema():
    assert set(VARIANTS) == {"free", "permanent", "visco-elastic", "embedded", "sliding"}
    text = str(json_schema())
    assert all(f"'const': '{variant}'" in text for variant in (*VARIANTS, NO_VARIANT))


def test_bounds_that_only_the_program_knows(validator, write):
    """JSON Schema cannot state definiteness or the range of eq. 5; the program checks both."""
    for text in (
        edited("[60, 60, 42]", "[[1, 2, 0], [2, 1, 0], [0, 0, 1]]"),
        edited("orientation: [0, 0, 0]", "orientation: [0, 2, 0]"),
    ):
        assert schema_errors(validator, text) == []
        with pytest.raises(ConfigError):
            load_config(write(text))
