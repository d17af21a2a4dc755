"""Runs with the code are those with numpy: same steps and events, same motion but for round-off."""

from typing import Any

import pytest
from support.configs import BY_VARIANT, plain
from support.problems import solve

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.integrate.straight_line.equations import StraightLine

PROBLEMS: dict[str, dict[str, Any]] = {
    "s = E, with sticking": {"K_s": 20000, "duration": 0.05, "stick_energy": 10.0},
    "s = E, implicit": {"K_s": 20000, "duration": 0.02, "step": 1e-4},
    "s = F + 20E": {"K_s": 20000, "slope": 20.0, "duration": 0.1},
    "s = F + 20E, released": {"K_s": 2000, "slope": 20.0, "duration": 0.3},
    "s = F + 20E, implicit": {"K_s": 20000, "slope": 20.0, "duration": 0.1, "step": 1e-3},
    "layer of E": {"K_s": 2000, "layer": 1e-3, "duration": 0.05},
}


@pytest.fixture
def by_numpy(monkeypatch):
    """Solves a problem with numpy's evaluation of the equations only."""

    def solved(problem):
        with monkeypatch.context() as patch:
            patch.setattr(StraightLine, "finite_value", lambda _line, _x: None)
            return solve("scipy", problem)

    return solved


def test_a_run_evaluates_by_its_code(monkeypatch):
    """Numpy evaluates no rates of a run of a paper's variant; a fallback would be slow."""
    problem = problem_of(load_config(plain(BY_VARIANT["embedded"]), ["integration.duration=0.1"]))
    calls = []
    monkeypatch.setattr(StraightLine, "by_numpy", lambda _line, x: calls.append(x))
    assert solve("scipy", problem).status == "completed"
    assert not calls
