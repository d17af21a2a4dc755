"""Protects `docs/sweeps.md`: its plans, error messages and Python code work as shown."""

import re
from pathlib import Path
from typing import Any

import pytest
from support.sweeping import run_sweep
from support.sweeps import plan_with_traces

import rbstab
from rbstab.sweep.plan.designs import DESIGNS
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import MAX_MEMBERS
from rbstab.sweep.plan.plan_file import PlanFile, Spread

PAGE = (Path(__file__).parents[3] / "docs" / "sweeps.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)


@pytest.mark.parametrize("text", blocks("yaml"))
def test_plans(load, text):
    text = text.replace("../paper/case2_visco_elastic.yaml", "visco-elastic.yaml")
    base = "" if "base:" in text else "base: visco-elastic.yaml\n"
    assert load(base + text).members > 1


def test_the_error(complaints):
    expected = blocks("text")[0].strip()
    text = (
        "base: visco-elastic.yaml\nvary:\n  body.mass: {normal: [1, 2]}\n"
        "design: random\nmembers: 100000\nseed: 1\n"
    )
    assert complaints(text) == [expected.removeprefix("plan.yaml:")]


def test_everything_is_described():
    for word in (*Spread.model_fields, "member"):
        assert f"| `{{{word}: [" in PAGE
    for key in PlanFile.model_fields:
        assert f"`{key}`" in PAGE
    assert f"{MAX_MEMBERS:,}" in PAGE
    limits = [design.max_points for design in DESIGNS.values() if design.max_points]
    assert limits
    assert all(f"{limit:,}" in PAGE for limit in limits)


def python_with(words):
    (found,) = [block for block in blocks("python") if words in block]
    return found


def test_the_python_of_traces(tmp_path, monkeypatch):
    (tmp_path / "results").mkdir()
    run_sweep(tmp_path / "results" / "plan", plan_with_traces(4001), shard_size=1000)
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"rbstab": rbstab}
    exec(python_with("traces.of(17)"), names)  # noqa: S102
    assert len(names["traces"].members) == 4001
    assert names["motions"]["run"].tolist() == [4000]


def test_the_python(monkeypatch):
    monkeypatch.chdir(Path(__file__).parents[3])
    names: dict[str, Any] = {}
    exec(python_with("plan_id(plan)"), names)  # noqa: S102
    assert names["plan"].members == 16384
    assert names["config"].body.mass == 50.0
    assert load_plan("configs/sweeps/robustness.yaml").config_of(17).body.mass == 41.0
