"""Protects the results of runs that stop early: they are complete up to the stop."""

import sys

import numpy as np
import pytest
from support.paper_runs import paper_config
from support.problems import ENGINES

import rbstab
from rbstab.integrate.engines import EngineMissingError

each_engine = pytest.mark.parametrize("engine", ENGINES)


@each_engine
def test_free_body_that_turns_over_leaves_the_range(engine):
    spin = {"angular_velocity": [0.0, 32.0, 0.0]}
    result = rbstab.simulate(paper_config("free", initial=spin, engine=engine))
    assert result.status == "range left"
    stop = result["time"][-1]
    assert np.cos(result["orientation"][-1, 1]) == pytest.approx(1e-3, rel=0, abs=1e-11)
    detail = f"cos θ2 fell to 0.001 at t = {stop:.9g} s"
    assert result.attributes["status_detail"] == detail
    # Every array ends with the stop and holds all samples before it.
    rows = len(result["time"])
    for name, variable in result.variables.items():
        if variable.dimensions[:1] == ("time",):
            assert len(variable.data) == rows, name
            assert np.isfinite(variable.data).all(), name
    np.testing.assert_array_equal(result["time"][:-1], np.linspace(0.0, 2.0, 401)[: rows - 1])


@each_engine
def test_step_and_time_limits_of_the_config_are_the_ones_that_count(engine):
    stopped = rbstab.simulate(paper_config("free", engine=engine, step_limit=3))
    assert stopped.status == "step limit"
    assert stopped.attributes["steps"] == 3
    hurried = rbstab.simulate(paper_config("free", engine=engine, time_limit=1e-9))
    assert hurried.status == "time limit"


@each_engine
def test_run_that_diverges_at_once_holds_its_start(engine):
    spin = {"angular_velocity": [1e200, 2e200, -1e200]}
    result = rbstab.simulate(paper_config("visco-elastic", initial=spin, engine=engine))
    assert result.status == "diverged"
    np.testing.assert_array_equal(result["time"], [0.0])
    np.testing.assert_array_equal(result["angular_velocity"], [spin["angular_velocity"]])
    assert result["energy"].shape == (1, 5)


@each_engine
def test_progress_is_passed_on(engine):
    seen: list[float] = []
    config = paper_config("free", samples=3, duration=0.2, engine=engine)
    result = rbstab.simulate(config, progress=seen.append)
    assert len(seen) == result.attributes["steps"]
    assert seen == sorted(seen)
    assert seen[-1] == 0.2


def test_missing_engine_is_said_before_anything_else(monkeypatch):
    monkeypatch.setitem(sys.modules, "heyoka", None)
    for module in ("engine", "run"):
        monkeypatch.delitem(sys.modules, f"rbstab.integrate.heyoka.{module}", raising=False)
    with pytest.raises(EngineMissingError, match="heyoka"):
        rbstab.simulate(paper_config("free", engine="heyoka"))
