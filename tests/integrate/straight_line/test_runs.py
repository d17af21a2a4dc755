"""A run is computed by its code, not by numpy."""

from support.configs import BY_VARIANT, plain
from support.problems import solve

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.integrate.straight_line.equations import StraightLine


def test_a_run_evaluates_by_its_code(monkeypatch):
    """Numpy evaluates no rates of a run of a paper's variant; a fallback would be slow."""
    problem = problem_of(load_config(plain(BY_VARIANT["embedded"]), ["integration.duration=0.1"]))
    calls = []
    monkeypatch.setattr(StraightLine, "by_numpy", lambda _line, *x: calls.append(x))
    assert solve("scipy", problem).status == "completed"
    assert not calls
