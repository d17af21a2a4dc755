"""A loaded config is complete, cannot be changed, and is stored and sent as itself."""

import copy
import hashlib
import json
import pickle
from typing import Any

import pytest
import yaml
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from support.config_elements import YAML, config_data
from support.configs import (
    BY_VARIANT,
    FREE,
    MANIFOLD,
    PERMANENT,
    SLIDING,
    SOLVER_DEFAULTS,
    VISCO_ELASTIC,
    edited,
    plain,
)
from support.inputs import SIGNALS, couple, driven
from support.stops import stop
from support.switching import guard, ligament

from rbstab.config.files.dump import as_yaml
from rbstab.config.load import load_config, resolved, resolved_yaml, run_id
from rbstab.config.source import parse_source

# Random texts are derandomized, so that a failure repeats, and leave no files behind.
REPEATED = settings(max_examples=150, deadline=None, derandomize=True, database=None)

INPUTS = {f"{kind}_{number}": couple(SIGNALS[kind]) for number, kind in enumerate(SIGNALS)}
SWITCHING = {
    "line": ligament(),
    "soft": guard("stiff", 4.0, 0.2),
    "range": guard("repelling", 4.0, 0.2),
    "end": stop(0.5),
}

TEXTS = {
    **BY_VARIANT,
    "sliding": SLIDING,
    "projection": MANIFOLD + "  drift_control: projection\n",
    "Baumgarte": MANIFOLD + "  drift_control: {baumgarte: 5}\n",
    "heyoka": VISCO_ELASTIC + "  engine: heyoka\n  rtol: 1e-15\n",
    "W": VISCO_ELASTIC + "  coordinates: W\n  method: Radau\n",
    "full": edited("[60, 60, 42]", "[[60, 1.5, 0], [1.5, 60, -1e-3], [0, -1e-3, 42]]"),
    "referenced": FREE + "reference: {source: p. 6, note: 'a: b', final: {velocity: [1, 2, 3]}}\n",
    "attached": edited("initial:", "initial:\n  attached: true"),
    "elements": YAML,
    "elements beside a controller": json.dumps(config_data()),
    "elements that switch": json.dumps(driven(SWITCHING)),
    "inputs": json.dumps(driven(INPUTS)),
}


@pytest.fixture(params=TEXTS)
def config(request, load):
    return load(TEXTS[request.param])


def test_a_stored_config_is_the_same_config(config, load):
    text = resolved_yaml(config)
    again = load(text)
    assert again == load_config(resolved(config)) == config
    assert resolved_yaml(again) == text
    # Programs without rbstab can read it too, and find the run id that the documentation states.
    data = yaml.safe_load(text)
    assert data == resolved(config)
    digest = json.dumps(data, sort_keys=True, separators=(",", ":")).encode()
    assert run_id(again) == run_id(config) == hashlib.sha256(digest).hexdigest()[:32]


def test_a_config_can_be_sent_and_copied(config):
    sent = pickle.loads(pickle.dumps(config))  # noqa: S301  # made on the same line
    for other in (sent, copy.copy(config), copy.deepcopy(config)):
        assert (other, hash(other)) == (config, hash(config))
        assert type(other.controller) is type(config.controller)
        assert list(map(type, other.elements.values())) == list(map(type, config.elements.values()))


def test_nothing_can_be_changed(config):
    before = config.model_dump_json()
    hash(config)  # so it holds no lists and no sets
    parts = (config.body, config.controller, config.initial, config.integration)
    for part in (config, *parts, *config.elements.values()):
        for name in (*type(part).model_fields, "anything"):
            with pytest.raises(ValidationError):
                setattr(part, name, 1)
    elements = config.elements
    for change in (
        lambda: elements.update(strut=None),
        lambda: elements.pop("strut"),
        elements.popitem,
        lambda: elements.setdefault("new", 1),
        elements.clear,
        lambda: elements.__setitem__("strut", 1),
        lambda: elements.__delitem__("strut"),
        lambda: elements.__ior__({"strut": 1}),
    ):
        with pytest.raises(TypeError, match="cannot be changed"):
            change()
    assert config.model_dump_json() == before


def test_keys_stand_in_the_order_of_a_written_config(load):
    """People read it: version and title come first, the settings last."""
    text = resolved_yaml(load(edited("Case", "é θ") + "reference: {source: a}\n"))
    keys = [line.split(":")[0] for line in text.splitlines() if line[0] != " "]
    expected = "schema_version title body gravity controller initial integration reference"
    assert keys == expected.split()
    assert 'title: "é θ"\n' in text
    assert "  mass: 41.0\n  inertia: [10.0, 8.0, 0.4]\n" in text


def test_what_has_no_effect_is_left_out(load):
    assert "drift_control" not in resolved(load(PERMANENT))["integration"]
    compiled = resolved(load(TEXTS["heyoka"]))["integration"]
    assert not {"method", "atol"} & set(compiled)
    assert "reference" not in resolved(load(VISCO_ELASTIC))
    for text in BY_VARIANT.values():
        assert "attached" not in resolved(load(text))["initial"]
    assert "position" not in resolved(load(TEXTS["attached"]))["initial"]


ZERO = (0.0, 0.0, 0.0)
FREE_START = {"position": ZERO, "velocity": ZERO, "coordinates": "Z"}
TIED_START = FREE_START | {"anchor": "origin"}

DEFAULTS: dict[str, tuple[str, dict[str, Any]]] = {
    "free": (FREE, FREE_START),
    "permanent": (
        PERMANENT,
        {"coordinates": "reduced", "drift_control": "none", "anchor": "origin"},
    ),
    "visco-elastic": (VISCO_ELASTIC, TIED_START),
    "embedded": (BY_VARIANT["embedded"], TIED_START | {"connector_state": ZERO}),
    "sliding": (
        SLIDING,
        TIED_START
        | {"coordinates": "W", "law": "exact", "stick_energy": 0.0, "step_limit": 100_000_000}
        | {"switch_limit": 10_000_000, "stored_switches": 100_000},
    ),
}


@pytest.mark.parametrize("variant", DEFAULTS)
def test_defaults_are_those_of_the_documentation(load, variant):
    """Changed ones would give other runs under the same config."""
    text, expected = DEFAULTS[variant]
    given = ("title", "initial", "  orient", "  angular", "  samples")
    config = load("\n".join(x for x in text.splitlines() if not x.startswith(given)))
    assert (config.schema_version, config.title, config.gravity) == (1, "untitled", ZERO)
    assert config.reference is None
    values = config.integration.model_dump() | config.initial.model_dump()
    values |= config.controller.model_dump()
    expected = {"samples": 401, "orientation": ZERO, "angular_velocity": ZERO} | (
        SOLVER_DEFAULTS | expected
    )
    assert {key: values.get(key) for key in expected} == expected


# Texts that some version of YAML could read as another value.
LOOKALIKES = """
yes ~ null true 5 5.0 1_0 0x1 2020-01-01 .inf = << #a *a &a !a %a @a `a | > ' " 012 5. 1e5 1e-9
.5e3 -1e+5 1e1000
"""
ODD_TEXTS = [*LOOKALIKES.split(), "- a", "a: b", "a #b", "é😀", " a", "a ", "a\tb", "a\nb", "\x7f"]
ODD_TEXTS += ["\ufeffa", "a\u2028b", "a\x85b", "x y " * 50]

NUMBERS = st.floats(1e-300, 1e300) | st.floats(0.1, 10) | st.integers(1, 10**6)
STORABLE = st.characters(exclude_characters="\0", exclude_categories=["Cs"])
NEARLY = st.text(alphabet="0123456789eE.+-_:xob~nul truefasy,{}[]#&*!|>'\"%@`=", max_size=8)


def survives(data, path):
    """Assert that a stored config has all numbers and texts of plain data."""
    config = load_config(data)
    path.write_bytes(resolved_yaml(config).encode())
    assert load_config(path) == config
    # PyYAML reads YAML 1.1, where yes and no are not texts.
    assert yaml.safe_load(resolved_yaml(config)) == resolved(config)


@pytest.mark.parametrize("title", ODD_TEXTS)
def test_every_odd_text_survives(tmp_path, title):
    survives(plain() | {"title": title}, tmp_path / "a.yaml")


@REPEATED
@given(
    mass=NUMBERS,
    x=st.floats(-1e300, 1e300),
    title=NEARLY | st.text(STORABLE, max_size=60),
    note=st.text(STORABLE, max_size=200),
)
def test_any_number_and_any_text_survives(tmp_path_factory, mass, x, title, note):
    assume(title)
    data = plain() | {"title": title, "reference": {"source": title, "note": note}}
    data["body"]["mass"] = mass
    data["initial"]["velocity"] = [x, -x, 0]
    survives(data, tmp_path_factory.getbasetemp() / "a.yaml")


LINES = st.text(st.sampled_from(" \t#:'\"\\|-{é½\x85\u2028\n"), max_size=25)


@REPEATED
@example(text="a:\n  b\n")
@given(text=LINES)
def test_any_code_survives(text):
    stored = as_yaml({"kind": "python", "source": text})
    assert parse_source(stored, "stored").data == {"kind": "python", "source": text}


@pytest.mark.parametrize(
    ("elements", "changes", "coordinates"),
    [
        ({}, {"controller": None}, "quaternion"),
        ({"end": guard("stiff", 4.0, 0.2)}, {"controller": None}, "Z"),
        ({}, {}, "Z"),
    ],
)
def test_motions_pass_the_pole_by_default_where_nothing_reads_angles(
    elements, changes, coordinates
):
    data = config_data(elements, **changes)
    data["integration"].pop("coordinates", None)
    config = load_config(data)
    assert config.integration.coordinates == coordinates
    again = load_config(config.plain())
    assert again == config
    assert run_id(again) == run_id(config)


@pytest.mark.parametrize(("stiffness", "coordinates"), [(0, "quaternion"), (1, "reduced")])
def test_a_held_body_without_springs_of_angles_passes_the_pole(stiffness, coordinates):
    config = load_config(plain(PERMANENT), [f"controller.K_r=[0,0,{stiffness}]"])
    assert config.integration.coordinates == coordinates


def test_a_config_in_quaternions_can_be_changed_to_read_angles():
    config = load_config(plain(PERMANENT), ["controller.K_r=[0,0,0]"])
    stored = yaml.safe_load(resolved_yaml(config))
    for source in (config, config.plain(), stored):
        assert load_config(source).integration.coordinates == "quaternion"
        changed = load_config(source, ["controller.K_r=[0,0,5]"])
        assert changed.integration.coordinates == "reduced"
    assert config.in_angles().integration.coordinates == "reduced"
    assert run_id(load_config(config.in_angles().plain())) != run_id(config)
