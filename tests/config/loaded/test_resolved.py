"""The resolved config is complete, and loading it gives the same run."""

import hashlib
import json

import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support.configs import (
    BY_VARIANT,
    FREE,
    PERMANENT,
    VISCO_ELASTIC,
    edited,
    plain,
)

from rbstab.config.load import load_config, resolved, resolved_yaml, run_id

TEXTS = {
    **BY_VARIANT,
    "manifold": PERMANENT + "  coordinates: manifold\n  drift_control: projection\n",
    "Baumgarte": PERMANENT + "  coordinates: manifold\n  drift_control: {baumgarte: 5}\n",
    "heyoka": VISCO_ELASTIC + "  engine: heyoka\n  rtol: 1e-15\n",
    "W": VISCO_ELASTIC + "  coordinates: W\n  method: Radau\n",
    "full": edited("[60, 60, 42]", "[[60, 1.5, 0], [1.5, 60, -1e-3], [0, -1e-3, 42]]"),
    "loaded": VISCO_ELASTIC + "gravity: [0, 1e-9, -9.81]\n",
    "referenced": FREE + "reference: {source: p. 6, note: 'a: b', final: {velocity: [1, 2, 3]}}\n",
    "peak": FREE + "reference: {source: p. 6, peak_contact_displacement: [1, 2, 3]}\n",
    "titled": edited("title: Case", "title: 'θ: 1e5 # ''x'' \\ \"y\"'"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_loads_as_the_same_run(load, name):
    config = load(TEXTS[name])
    again = load(resolved_yaml(config))
    assert run_id(again) == run_id(config)
    assert resolved(again) == resolved(config)
    assert resolved_yaml(again) == resolved_yaml(config)


@pytest.mark.parametrize("name", TEXTS)
def test_another_reader_of_yaml_finds_the_same(load, name):
    """Programs without rbstab can read the stored config."""
    config = load(TEXTS[name])
    assert yaml.safe_load(resolved_yaml(config)) == resolved(config)


@pytest.mark.parametrize("name", TEXTS)
def test_run_id_is_what_its_documentation_says(load, name):
    config = load(TEXTS[name])
    data = yaml.safe_load(resolved_yaml(config))
    text = json.dumps(data, sort_keys=True, separators=(",", ":"))
    assert run_id(config) == hashlib.sha256(text.encode()).hexdigest()[:32]


def test_keys_stand_in_the_order_of_a_written_config(load):
    """People read it: version and title come first, the settings last."""
    text = resolved_yaml(load(VISCO_ELASTIC + "reference: {source: a}\n"))
    keys = [line.split(":")[0] for line in text.splitlines() if line[0] != " "]
    assert keys == [
        "schema_version",
        "title",
        "body",
        "gravity",
        "controller",
        "initial",
        "integration",
        "reference",
    ]
    assert "é θ" in resolved_yaml(load(edited("title: Case", "title: é θ")))
    assert "  mass: 41.0\n  inertia: [10.0, 8.0, 0.4]\n" in text


def test_what_has_no_effect_is_left_out(load):
    assert "drift_control" not in resolved(load(PERMANENT))["integration"]
    compiled = resolved(load(VISCO_ELASTIC + "  engine: heyoka\n"))["integration"]
    assert not {"method", "atol"} & set(compiled)
    assert "reference" not in resolved(load(VISCO_ELASTIC))


NUMBERS = st.floats(1e-300, 1e300) | st.floats(0.1, 10) | st.integers(1, 10**6)


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(mass=NUMBERS, gain=NUMBERS, x=st.floats(-1e300, 1e300))
def test_every_number_survives(tmp_path_factory, mass, gain, x):
    data = plain()
    data["body"]["mass"] = mass
    data["controller"]["K_t"] = [gain, 1, 1]
    data["initial"]["velocity"] = [x, -x, 0]
    config = load_config(data)
    path = tmp_path_factory.getbasetemp() / "numbers.yaml"
    path.write_text(resolved_yaml(config), encoding="utf-8")
    again = load_config(path)
    assert again == config
    assert run_id(again) == run_id(config)


# Texts that some version of YAML could read as another value.
TITLES = ["yes", "~", "null", "true", "5", "5.0", "1_0", "0x1", "2020-01-01", ".inf", "=", "<<"]
TITLES += ["- a", "a: b", "a #b", "#a", "*a", "&a", "!a", "%a", "@a", "`a", "|", ">", "'", '"']
TITLES += [
    "é😀",
    " a",
    "a ",
    "a\tb",
    "a\nb",
    "\x7f",
    "\ufeffa",
    "a\u2028b",
    "x y " * 50,
    "012",
    "5.",
]
AS_NUMBERS = ["1e5", "1e-9", "1E5", ".5e3", "-1e+5", "1e1000"]


@pytest.mark.parametrize("title", [*TITLES, *AS_NUMBERS, "a\x85b"])
def test_every_title_survives(load, title):
    config = load_config(plain() | {"title": title})
    again = load(resolved_yaml(config))
    assert again.title == title
    # PyYAML reads YAML 1.1, where yes and no are not texts.
    assert yaml.safe_load(resolved_yaml(config))["title"] == title
    assert run_id(again) == run_id(config)


LOOKALIKES = st.text(alphabet="0123456789eE.+-_:xob~nul truefasy,{}[]#&*!|>'\"%@`=", max_size=8)

STORABLE = st.characters(exclude_characters="\0", exclude_categories=["Cs"])


@settings(max_examples=150, deadline=None, derandomize=True, database=None)
@given(title=LOOKALIKES | st.text(STORABLE, max_size=60), note=st.text(STORABLE, max_size=200))
def test_any_text_survives(tmp_path_factory, title, note):
    assume(title)
    reference = {"source": title, "note": note}
    config = load_config(plain() | {"title": title, "reference": reference})
    path = tmp_path_factory.getbasetemp() / "texts.yaml"
    path.write_bytes(resolved_yaml(config).encode())
    assert load_config(path) == config
    assert yaml.safe_load(resolved_yaml(config)) == resolved(config)
