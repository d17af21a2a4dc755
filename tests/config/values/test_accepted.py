"""Configs that are right: the program and the JSON Schema for editors accept them; their units."""

import json
from typing import Any

import numpy as np
import pytest
from support.config_elements import EACH_KIND, UPRIGHT, YAML, config_data
from support.configs import (
    BY_VARIANT,
    EMBEDDED,
    FREE,
    MANIFOLD,
    PERMANENT,
    SLIDING,
    VISCO_ELASTIC,
    edited,
    plain,
)
from support.inputs import SIGNALS, driven, force
from support.json_schemas import schema_errors, validator_of
from support.stops import stop
from support.switching import data, guard, ligament

from rbstab.config.load import load_config
from rbstab.config.schema import NO_VARIANT, VARIANTS, json_schema
from rbstab.config.units import unit_of
from rbstab.mechanics.attitude import rotation
from rbstab.sweep.plan.load import load_plan

ZERO = "orientation: [0, 0, 0]"
DAMPING = "L_r: [60, 60, 42]"
LINE = {"it": ligament()}

ACCEPTED = [
    *BY_VARIANT.values(),
    VISCO_ELASTIC + "gravity: [0, 0, -9.81]\nschema_version: 1.0\n",
    VISCO_ELASTIC + "  engine: heyoka\n  coordinates: W\n  method: Radau\n  atol: 1\n",
    VISCO_ELASTIC + "bound: {couple: 20, tilt: {deg: 89}}\n",
    VISCO_ELASTIC + "bound: {force: 1e-9, point: [0, 0, 0.4], tilt: 1.57}\n",
    VISCO_ELASTIC + "reference:\n",
    VISCO_ELASTIC + "reference: {source: a, note: b, final: {position: [1, 2, 3]}}\n",
    edited("title: Case\n", ""),
    edited("  samples: 11\n", ""),
    edited("samples: 11", "samples: 1e3\n  step_limit: 1e6"),
    edited("  K_t:", "  anchor: equilibrium\n  K_t:", EMBEDDED),
    edited("K_t: [4100, 4100, 3280]", "K_t: [1, 1, 1e-9]\n  anchor: equilibrium"),
    edited("initial:", "initial:\n  connector_state: [1, 2, 3]", EMBEDDED),
    edited("initial:", "initial:\n  attached: true"),
    edited("initial:", "initial:\n  attached: true", PERMANENT),
    *(
        edited(DAMPING, f"L_r: {gain}")
        for gain in (
            *("0", "-0.0", "[60, 0, 42]", "[1e-9, 1, 1e9]", "[[60, 1, 0], [1, 60, 0], [0, 0, 42]]"),
            *("[[2, -1, 0], [-1, 2, -1], [0, -1, 2]]", "[[1, 1, 0], [1, 1, 0], [0, 0, 0]]"),
        )
    ),
    edited("[10.0, 8.0, 0.4]", "[[1, 0, 0], [0, 1, 0], [0, 0, 1e-13]]"),
    *(edited(ZERO, f"orientation: {given}") for given in ("{deg: [0, 10, 0]}", "[0, 0.1, 0]")),
    *(
        f"{MANIFOLD}  drift_control: {control}\n"
        for control in ("none", "projection", "{baumgarte: 5}")
    ),
    FREE + "  range_bound: 0.5\n  step_limit: 1\n  time_limit: 1e-3\n  rtol: 0.1\n",
    # Zero is the default of the energy of sticking, so a resolved config contains it.
    *(
        edited("surface: position", f"{line}\n  stick_energy: 0", SLIDING)
        for line in (
            "surface: {slope: 20}",
            "surface: position\n  law: {implicit: 1.0e-3}",
            "surface: position\n  law: {boundary_layer: 1.0e-3}",
        )
    ),
    YAML,
    *(
        json.dumps(plain(text) | {"schema_version": 2, "elements": EACH_KIND})
        for text in BY_VARIANT.values()
    ),
    json.dumps(config_data({})),
    json.dumps(config_data(controller=None)),
    json.dumps(config_data(controller={"variant": "none"})),
    json.dumps(config_data(dict.fromkeys(["a", "a1_b", "x" * 40, "a__", "connector2"], UPRIGHT))),
    # Methods that stop at switches; heyoka does not use the method, and smooth elements need none.
    *(
        json.dumps(data(LINE, integration={"method": method}))
        for method in ("DOP853", "RK45", "Radau")
    ),
    json.dumps(data(LINE, integration={"method": "LSODA", "engine": "heyoka"})),
    json.dumps(config_data(integration={"method": "LSODA"})),
    json.dumps(driven({"a": force(SIGNALS["sine"])}, integration={"method": "LSODA"})),
    json.dumps(plain(SLIDING) | {"schema_version": 2, "elements": LINE}),
    json.dumps(data({"end": stop(), "soft": guard("repelling", 4.0, 0.29)})),
    json.dumps(data({"end": stop()}, {"orientation": [2.0, -0.3, 2.0]})),
    json.dumps(data({"a": stop(1, 1.57), "b": guard("stiff", 4.0, 1.56)})),
]


@pytest.fixture(scope="module")
def validator():
    schema = json_schema()
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    return validator_of(schema)


@pytest.mark.parametrize("text", ACCEPTED)
def test_the_program_and_the_schema_accept_it(validator, load, text):
    load(text)
    assert schema_errors(validator, text) == []


def objects_of(node, path="$"):
    """Yield the path and the schema of each object; parts of conditions are none."""
    if isinstance(node, dict):
        if "properties" in node and node.get("type") == "object":
            yield path, node
        for key, value in node.items():
            yield from objects_of(value, f"{path}.{key}")
    elif isinstance(node, list):
        for index, value in enumerate(node):
            yield from objects_of(value, f"{path}[{index}]")


# Their names, or the values they may have, explain them.
SELF_EXPLAINING = """
schema_version title variant kind method source note final coordinates engine rtol step_limit
switch_limit
"""
OF_FINAL_STATE = {"orientation", "angular_velocity", "position", "velocity"}


def test_the_schema_says_what_each_section_and_number_is():
    schema = json_schema()
    objects = dict(objects_of(schema))
    assert len(objects) > 10
    for path, node in objects.items():
        assert not node["description"].strip().endswith(":"), path
        assert node["additionalProperties"] is False, path
        final = OF_FINAL_STATE if path.endswith("FinalState") else set()
        for key, value in node["properties"].items():
            assert (
                "description" in value
                or "$ref" in str(value)
                or key in {*SELF_EXPLAINING.split(), *final}
            ), (path, key)
    assert set(VARIANTS) == {"free", "permanent", "visco-elastic", "embedded", "sliding"}
    assert all(f"'const': '{variant}'" in str(schema) for variant in (*VARIANTS, NO_VARIANT))


SPRING, BARRIER = {"kind": "spring"}, {"kind": "guard", "method": "barrier"}
STIFF = {"kind": "guard", "method": "stiff"}
FORCE = {"kind": "input", "quantity": "force"}


@pytest.mark.parametrize(
    ("key", "elements", "unit"),
    [
        ("elements.strut.stiffness", [SPRING], "N/m"),
        ("elements.strut.stiffness", [BARRIER], "N m"),
        ("elements.strut.stiffness", [STIFF], "N m/rad"),
        ("elements.strut.stiffness", [SPRING, BARRIER], ""),
        ("elements.strut.point", [SPRING, {"kind": "visco-elastic"}], "m"),
        ("elements.strut.kind", [SPRING], ""),
        ("elements.strut.stiffness", [], ""),
        ("elements.strut.stiffness", [{"kind": ["spring"]}], ""),
        ("elements.a.amplitude", [FORCE], "N"),
        ("elements.a.amplitude", [{"kind": "input", "quantity": "body_couple"}], "N m"),
        ("elements.a.signal.frequency", [FORCE], "Hz"),
        ("controller.L_c", [], "N s/m"),
    ],
)
def test_units(key, elements, unit):
    assert unit_of(key, elements) == unit


def test_a_matrix_of_numpy_is_symmetric_to_round_off():
    R = rotation(np.array([0.3, 0.5, -0.7]))
    J = R @ np.diag([3.0, 2.0, 1.5]) @ R.T
    J[0, 1] += 1e-13
    assert (J != J.T).any()
    data = plain(VISCO_ELASTIC)
    data["body"]["inertia"] = J.tolist()
    read = np.array(load_config(data).body.inertia)
    assert (read == read.T).all()
    assert np.abs(read - J).max() < 1e-12


def test_whole_floats_are_whole_numbers(load):
    settings = load(VISCO_ELASTIC, "integration.samples=1e3").integration
    assert repr(settings.samples) == "1000"
    plan: dict[str, Any] = {"base": plain(), "design": "random", "members": 1e1, "seed": 3.0}
    assert load_plan({**plan, "vary": {"body.mass": {"uniform": [1, 2]}}}).members == 10
    lists = {"body.mass": {"linspace": [1, 2, 5e0]}}
    assert load_plan({"base": plain(), "vary": lists}).members == 5
