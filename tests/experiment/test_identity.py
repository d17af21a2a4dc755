"""Protects the identity of a result: its run id, its config, its attributes, and equal reruns."""

import datetime
import re
from typing import Any

import numpy as np
import pytest
import yaml
from support.paper_runs import paper_config
from support.problems import ENGINES
from support.systems import VARIANTS

import rbstab

each_engine = pytest.mark.parametrize("engine", ENGINES)


def assert_identical(result, expected):
    assert set(result.variables) == set(expected.variables)
    for name in expected.variables:
        np.testing.assert_array_equal(result[name], expected[name], err_msg=name)


@each_engine
@pytest.mark.parametrize("variant", VARIANTS)
def test_stored_config_gives_the_same_run_bit_for_bit(variant, engine):
    config = paper_config(variant, with_gravity=True, engine=engine, duration=0.3, samples=61)
    first = rbstab.simulate(config)
    again = rbstab.simulate(yaml.safe_load(first.config))
    assert again.run_id == first.run_id
    assert again.config == first.config
    assert_identical(again, first)
    assert again.attributes["steps"] == first.attributes["steps"]


@each_engine
def test_attributes_say_what_was_run_and_with_what(engine):
    config = paper_config("embedded", samples=3, duration=0.1, engine=engine)
    result = rbstab.simulate(config | {"title": "a try"})
    attributes: dict[str, Any] = dict(result.attributes)
    assert attributes["title"] == "a try"
    assert attributes["variant"] == "embedded"
    assert attributes["engine"] == engine
    assert attributes["status"] == result.status == "completed"
    assert attributes["status_detail"] == ""
    assert re.fullmatch("[0-9a-f]{32}", attributes["run_id"])
    assert 0 < attributes["steps"] <= attributes["evaluations"]
    assert 0 < attributes["wall_time"] < 60
    import h5py
    import heyoka
    import scipy

    module = {"scipy": scipy, "heyoka": heyoka}
    other = {"scipy": "heyoka", "heyoka": "scipy"}[engine]
    assert attributes[f"{engine}_version"] == module[engine].__version__
    assert f"{other}_version" not in attributes
    assert attributes["numpy_version"] == np.__version__
    assert attributes["h5py_version"] == h5py.__version__
    assert re.fullmatch(r"([0-9a-f]{40}\+?)?", attributes["commit"])
    created = datetime.datetime.fromisoformat(attributes["created"])
    age = datetime.datetime.now(datetime.UTC) - created
    assert datetime.timedelta(seconds=-1) <= age < datetime.timedelta(minutes=5)
    assert all(isinstance(value, str | int | float) for value in attributes.values())


def test_settings_of_the_config_reach_the_integration():
    loose: dict[str, Any] = {"rtol": 1e-4, "atol": 1e-4, "samples": 2}
    settings: dict[str, dict[str, Any]] = {
        "plain": {},
        "rtol": {"rtol": 1e-10},
        "atol": {"atol": 1e-10},
        "method": {"method": "RK45"},
        "coordinates": {"coordinates": "manifold"},
        "projection": {"coordinates": "manifold", "drift_control": "projection"},
        "baumgarte": {"coordinates": "manifold", "drift_control": {"baumgarte": 20.0}},
    }
    runs = {
        name: rbstab.simulate(paper_config("permanent", **(loose | changes)))
        for name, changes in settings.items()
    }
    steps: dict[str, Any] = {name: run.attributes["steps"] for name, run in runs.items()}
    assert steps["rtol"] > 1.2 * steps["plain"]
    assert steps["atol"] > 1.2 * steps["plain"]
    assert steps["method"] > 1.2 * steps["plain"]
    drift = {
        name: runs[name]["constraint_position_residual"][-1]
        for name in ("coordinates", "projection", "baumgarte")
    }
    assert drift["projection"] < 1e-14
    assert 1e-14 < drift["baumgarte"] < 0.5 * drift["coordinates"]
