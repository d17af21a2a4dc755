"""A config can be a mapping from Python, with tuples, numpy arrays and numpy numbers."""

from collections import OrderedDict
from types import MappingProxyType

import numpy as np
import pytest
from support.configs import BY_VARIANT, plain

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config, run_id


def with_mass(value):
    data = plain()
    data["body"]["mass"] = value
    return data


def with_inertia(value):
    data = plain()
    data["body"]["inertia"] = value
    return data


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_a_mapping_gives_the_config_of_the_file(load, variant):
    text = BY_VARIANT[variant]
    assert load_config(plain(text)) == load(text)
    assert run_id(load_config(plain(text))) == run_id(load(text))


SAME = [
    with_inertia((10.0, 8.0, 0.4)),
    with_inertia(np.array([10.0, 8.0, 0.4])),
    with_inertia([np.float64(10), np.int64(8), 0.4]),
    with_mass(41),
    with_mass(np.float64(41)),
    with_mass(np.float32(41)),
    with_mass(np.int8(41)),
    with_mass(np.array(41.0)),
    OrderedDict(reversed(plain().items())),
    MappingProxyType(plain()),
]


@pytest.mark.parametrize("data", SAME)
def test_kinds_of_numbers_and_containers(data):
    assert load_config(data) == load_config(plain())


def test_a_matrix_as_a_list_of_arrays():
    rows = [np.array([10, 0, 0]), (0, 8, 0), np.array([0.0, 0.0, 0.4], dtype=np.float32)]
    inertia = load_config(with_inertia(rows)).body.inertia
    assert inertia[:2] == ((10.0, 0.0, 0.0), (0.0, 8.0, 0.0))
    assert all(isinstance(row, tuple) and all(type(x) is float for x in row) for row in inertia)


@pytest.mark.parametrize("kind", [tuple, list, np.array])
def test_an_entry_of_any_sequence_can_be_set(kind):
    config = load_config(with_inertia(kind([10.0, 8.0, 0.4])), ["body.inertia[1]=9"])
    assert config.body.inertia == (10.0, 9.0, 0.4)


def test_the_mapping_is_neither_changed_nor_kept():
    data = plain()
    config = load_config(data, ["body.mass=7", "gravity=[0, 0, 1]"])
    assert data == plain()
    data["body"]["inertia"][0] = -1.0
    assert config.body.inertia == (10.0, 8.0, 0.4)
    assert config.body.mass == 7.0


REFUSED = [
    (with_mass(-1), "config:1:1: body.mass: is -1 (expected a number greater than 0)"),
    (with_mass(float("nan")), "config:1:1: body.mass: is nan (expected a finite number)"),
    (with_mass(np.bool_(True)), "config:1:1: body.mass: is true (expected a number)"),
    (with_mass(1j), "config:1:1: body.mass: is a complex (expected a number)"),
    (with_mass(None), "config:1:1: body.mass: is empty (expected a number)"),
    (with_mass(np.array([1.0])), "config:1:1: body.mass: is a list of 1 (expected a number)"),
    (with_inertia(np.zeros((2, 3))), "config:1:1: body.inertia: has 2 entries (expected 3)"),
    (with_inertia(np.array(["a", "1", "1"])), "config:1:1: body.inertia[0]: is the text 'a'"),
    (plain() | {"titel": "x"}, "config:1:1: titel: is unknown (did you mean title?)"),
    (plain() | {5: "x"}, "config:1:1: 5: is unknown (expected one of schema_version,"),
    (plain() | {"controller": None}, "config:1:1: controller: is "),
]


@pytest.mark.parametrize(("data", "expected"), REFUSED)
def test_refused(data, expected):
    with pytest.raises(ConfigError) as caught:
        load_config(data)
    assert str(caught.value).splitlines()[0].startswith(expected)


@pytest.mark.parametrize("value", [object(), b"41", 10**400, range])
def test_a_value_of_a_foreign_kind(value):
    with pytest.raises(ConfigError, match=r"body\.mass: is "):
        load_config(with_mass(value))


def test_a_mapping_that_holds_itself():
    data = plain()
    data["body"]["again"] = data
    with pytest.raises(ConfigError):
        load_config(data)


def test_a_set_has_no_order():
    with pytest.raises(ConfigError, match=r"body\.inertia: is "):
        load_config(with_inertia({10.0, 8.0, 0.4}))


def test_what_is_neither_path_nor_mapping():
    for wrong in (None, 5, [1]):
        with pytest.raises(TypeError):
            load_config(wrong)  # type: ignore[arg-type]  # a wrong type on purpose


@pytest.mark.parametrize("kind", ["lists", "mappings"])
def test_the_depth_of_nesting(kind):
    """As in a file: 16 levels with the outermost mapping, and a value in the innermost one."""

    def nested(levels):
        value: object = 1
        for _ in range(levels - 1):
            value = [value] if kind == "lists" else {"a": value}
        return {"more": value}

    with pytest.raises(ConfigError, match="more: is unknown"):
        load_config(plain() | nested(16))
    with pytest.raises(ConfigError) as caught:
        load_config(plain() | nested(17))
    assert str(caught.value) == "config:1:1: is nested too deeply (at most 16 levels)"
