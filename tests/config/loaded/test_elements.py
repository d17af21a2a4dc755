"""Protects loaded configs with elements: resolved, named by an id, pickled, and never changed."""

import copy
import json
import pickle
from pathlib import Path
from typing import Any

import pytest
import yaml
from pydantic import ValidationError
from support.config_elements import CONTROLLER, ONE_OF_EACH, TIE, YAML, config_data
from support.configs import BY_VARIANT, plain
from support.fresh_process import printed_with_hash_seeds

import rbstab
from rbstab.config.build import system_of
from rbstab.config.load import load_config, resolved, resolved_yaml, run_id
from rbstab.config.numbers import entries_of, replaced, value_at
from rbstab.elements.attitude_spring import AttitudeSpring
from rbstab.elements.guards.barrier import Barrier
from rbstab.elements.spring import Spring
from rbstab.elements.visco_elastic import ViscoElasticTie

STORED = Path(__file__).parents[2] / "formats" / "data"
STORED_RUNS = [*STORED.glob("*.h5"), *STORED.glob("*/runs/*.h5")]

WITH = {
    variant: plain(text) | {"schema_version": 2, "elements": ONE_OF_EACH}
    for variant, text in BY_VARIANT.items()
} | {"none": config_data(controller=None)}


@pytest.fixture(params=WITH)
def config(request):
    return load_config(WITH[request.param])


def test_resolved_config_loads_to_the_same(config, tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(resolved_yaml(config))
    for again in (load_config(path), load_config(resolved(config))):
        assert again == config
        assert run_id(again) == run_id(config)
    data = resolved(config)
    assert json.loads(json.dumps(data)) == data
    assert data["schema_version"] == 2
    assert list(data["elements"]) == sorted(ONE_OF_EACH)
    assert data["elements"]["strut"]["damping"] == 40.0


def test_it_can_be_pickled_and_copied(config):
    again = pickle.loads(pickle.dumps(config))  # noqa: S301  # made on the same line
    for other in (again, copy.copy(config), copy.deepcopy(config)):
        assert other == config
        assert hash(other) == hash(config)
        assert [type(one) for one in other.elements.values()] == [
            type(one) for one in config.elements.values()
        ]


def test_nothing_can_be_changed(config):
    before, elements = config.model_dump_json(), config.elements
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
    for element in elements.values():
        for name in type(element).model_fields:
            with pytest.raises(ValidationError):
                setattr(element, name, getattr(element, name))
    assert config.model_dump_json() == before


def test_order_of_the_elements_has_no_effect():
    turned = dict(reversed(ONE_OF_EACH.items()))
    assert list(turned) != list(ONE_OF_EACH)
    one, other = (load_config(config_data(elements)) for elements in (ONE_OF_EACH, turned))
    assert run_id(one) == run_id(other)
    assert (one, hash(one)) == (other, hash(other))
    # Sums of floats depend on their order: the systems have the same.
    systems = [system_of(config).elements for config in (one, other)]
    assert [e.name for e in systems[0]] == [e.name for e in systems[1]]


def test_run_id_depends_on_each_number():
    base = config_data()
    changes = [
        "elements.strut.point[0]=0.021",
        "elements.strut.anchor[2]=1.41",
        "elements.strut.stiffness=901",
        "elements.strut.rest_length=0.81",
        "elements.strut.damping=0",
        "elements.tie.K_c[2][2]=2001",
        "elements.tie.L_c[1]=31",
        "elements.upright.K[0]=401",
        "elements.upright.L[0]=21",
        "elements.range.stiffness=11",
        "elements.range.outer_stiffness=0",
        "elements.more={kind: attitude, K: [1, 1, 1], L: [1, 1, 1]}",
    ]
    ids = [run_id(load_config(base, [change])) for change in changes]
    ids.append(run_id(load_config(base)))
    renamed = {("brace" if name == "strut" else name): x for name, x in ONE_OF_EACH.items()}
    ids.append(run_id(load_config(config_data(renamed))))
    ids.append(run_id(load_config(config_data({}))))
    assert len(set(ids)) == len(ids)


def test_run_id_is_the_same_in_every_process(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(YAML)
    script = (
        "import sys; from rbstab.config.load import load_config, run_id\n"
        "print(run_id(load_config(sys.argv[1])))"
    )
    assert printed_with_hash_seeds(script, path) == {run_id(load_config(path))}


@pytest.mark.parametrize("path", STORED_RUNS, ids=lambda path: path.stem)
def test_ids_of_version_one_are_those_of_stored_runs(path):
    """A config that an older version stored resolves to the same text, and so to the same id."""
    stored = rbstab.open_result(path)
    config = load_config(yaml.safe_load(stored.config))
    assert run_id(config) == stored.run_id
    assert resolved_yaml(config) == stored.config
    assert "elements" not in resolved(config)


def test_there_are_stored_runs():
    assert len(STORED_RUNS) > 5


def test_system_has_the_elements_of_the_config():
    system = system_of(load_config(config_data()))
    kinds = [type(element) for element in system.elements]
    assert kinds[-4:] == [Barrier, Spring, ViscoElasticTie, AttitudeSpring]
    assert [element.name for element in system.elements[-4:]] == sorted(ONE_OF_EACH)
    strut: Any = system.elements[-3]
    tie: Any = system.elements[-2]
    assert tie.K_c.tolist() == TIE["K_c"]
    assert tie.L_c.tolist() == [[30.0, 0, 0], [0, 30.0, 0], [0, 0, 12.0]]
    assert (tie.point.tolist(), tie.anchor.tolist()) == (TIE["point"], TIE["anchor"])
    assert strut.rest_length == 0.8


def test_without_a_controller_nothing_else_acts():
    system = system_of(load_config(config_data(controller=None)))
    assert [element.name for element in system.elements] == ["gravity", *sorted(ONE_OF_EACH)]
    bare = system_of(load_config(config_data({}, None)))
    assert [element.name for element in bare.elements] == ["gravity"]


def test_numbers_of_elements_are_entries_that_can_be_replaced():
    config = load_config(config_data())
    keys = {entry.key: entry for entry in entries_of(config)}
    own = [key for key in keys if key.startswith("elements.")]
    # Spring 9, tie 6 + 6 + 3, attitude 6, guard 2.
    assert len(own) == 9 + 15 + 6 + 2
    entry = keys["elements.tie.K_c[0][1]"]
    assert entry.value == 100.0
    changed = replaced(config, dict.fromkeys(entry.paths, 90.0))
    assert changed.elements["tie"].K_c[1][0] == changed.elements["tie"].K_c[0][1] == 90.0
    assert changed.elements["strut"] == config.elements["strut"]
    assert hash(changed) != hash(config)
    assert value_at(changed, ("elements", "strut", "point", 2)) == 0.3
    for path in (("elements", "other"), ("elements", "strut", "point", 3)):
        with pytest.raises(LookupError):
            value_at(config, path)


def test_results_name_the_forces_of_each_element():
    data = config_data(integration={"duration": 0.1, "samples": 3})
    result = rbstab.simulate(data)
    assert result["element"].tolist() == sorted(ONE_OF_EACH)
    force, couple = result["element_force"], result["element_couple"]
    assert force.shape == couple.shape == (3, 4, 3)
    assert not force[:, [0, 3]].any()  # the guard and the attitude spring have couples only
    assert force[:, [1, 2]].all()
    assert couple.any(axis=(0, 2)).all()
    free = config_data({}, CONTROLLER, integration={"duration": 0.1, "samples": 3})
    assert "element_force" not in rbstab.simulate(free)
