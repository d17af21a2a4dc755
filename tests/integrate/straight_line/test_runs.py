"""Runs with the code are those with numpy: same steps and events, same motion but for round-off."""

from typing import Any

import numpy as np
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


def check(found, expected, tolerance):
    assert (found.status, found.detail) == (expected.status, expected.detail)
    np.testing.assert_array_equal(found.times, expected.times)
    vectors = [*np.split(expected.states, expected.states.shape[1] // 3, axis=1)]
    for first, vector in enumerate(vectors):
        scale = np.abs(vector).max()
        difference = np.abs(found.states[:, 3 * first : 3 * first + 3] - vector).max()
        assert difference <= tolerance * scale
    for name in ("lyapunov_change", "contact_work"):
        value = getattr(expected, name)
        scale = max(np.abs(value).max(), np.abs(expected.lyapunov_change).max())
        assert np.abs(getattr(found, name) - value).max() <= tolerance * scale


@pytest.mark.parametrize("method", ["DOP853", "RK45", "Radau", "LSODA"])
@pytest.mark.parametrize("variant", BY_VARIANT)
def test_motions_by_every_method(by_numpy, variant, method):
    changes = [f"integration.method={method}", "integration.duration=0.3", "integration.samples=7"]
    if method != "DOP853":
        changes += ["integration.rtol=1e-7", "integration.atol=1e-9"]
    problem = problem_of(load_config(plain(BY_VARIANT[variant]), changes))
    # LSODA chooses its order by comparing numbers that differ by round-off.
    tolerance = 1e-6 if method == "LSODA" else 1e-13
    check(solve("scipy", problem), by_numpy(problem), tolerance)


def test_a_run_evaluates_by_its_code(monkeypatch):
    """Numpy evaluates no rates of a run of a paper's variant; a fallback would be slow."""
    problem = problem_of(load_config(plain(BY_VARIANT["embedded"]), ["integration.duration=0.1"]))
    calls = []
    monkeypatch.setattr(StraightLine, "by_numpy", lambda _line, x: calls.append(x))
    assert solve("scipy", problem).status == "completed"
    assert not calls
