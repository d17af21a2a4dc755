"""Protects what `rbstab show` says of impacts (their number, energy, and a rest), and of v."""

import re

import pytest
from click.testing import CliRunner
from support.figure_runs import run_of
from support.stops import stop
from support.switching import data

import rbstab
from rbstab_cli.main import cli


def test_show_counts_impacts_and_says_when_the_body_rests(tmp_path):
    """Its weight presses the held body against the stop."""
    start = {"angular_velocity": [0, 1.3, 0]}
    config = data({"end": stop(0.5)}, start, {"duration": 3.0})
    gains = {"K_t": [40.0] * 3, "L_t": [9.0] * 3, "K_r": [9.0] * 3, "L_r": [3.0] * 3}
    config |= {"controller": {"variant": "permanent"} | gains, "gravity": [0.0, 0.0, -9.81]}
    config["body"] |= {"contact_point": [-0.8, 0.1, -0.2]}
    result = rbstab.simulate(rbstab.load_config(config))
    path = tmp_path / "a.h5"
    rbstab.write_result(path, result)
    shown = CliRunner().invoke(cli, ["show", str(path)]).stdout
    (line,) = re.findall(r"^ impacts +(.*?) *$", shown, flags=re.MULTILINE)
    count, lost = len(result["impact_time"]), float(result["impact_loss"][-1])
    assert result["stop_contact"][-1]
    rests = f"rests against the stop from t = {result['rest_begin'][-1]:.4g} s"
    assert line == f"{count}, which took {lost:.4g} J; {rests}"


def test_show_does_not_call_v_minus_work_v(tmp_path):
    """On s = F + κE a result stores v - ε, which does not fall to zero; v = (v - ε) + ε."""
    result = run_of("sliding").result
    rbstab.write_result(tmp_path / "a.h5", result)
    shown = CliRunner().invoke(cli, ["show", str(tmp_path / "a.h5")]).stdout
    assert " impacts " not in shown
    named = r"v\(0\)|v\(end\)|v - ε at 0 and at the end"
    rows = dict(re.findall(rf"^ ({named}) +(.*?) *$", shown, re.M))
    v = result["lyapunov"] + result["contact_work"]
    # Facts have four digits, and v - ε has seven.
    assert float(rows["v(0)"].removesuffix(" J")) == pytest.approx(v[0], rel=6e-4)
    assert float(rows["v(end)"].removesuffix(" J")) == pytest.approx(v[-1], rel=6e-4)
    ends = rows["v - ε at 0 and at the end"].split(", ")
    values = [float(text.removesuffix(" J")) for text in ends]
    assert values == pytest.approx(result["lyapunov"][[0, -1]].tolist(), rel=1e-6)
