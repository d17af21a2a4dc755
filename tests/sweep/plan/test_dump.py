"""Protects the written form of a plan: loaded from any folder, it is the same plan."""

from pathlib import Path

import pytest

from rbstab.sweep.plan.load import load_plan, plan_yaml
from rbstab.sweep.plan.plan import plan_id

READY = sorted((Path(__file__).parents[3] / "configs" / "sweeps").glob("*.yaml"))


def assert_reloads_unchanged(plan, tmp_path):
    path = tmp_path / "elsewhere" / "plan.yaml"
    path.parent.mkdir()
    path.write_text(plan_yaml(plan))
    again = load_plan(path, allow_python=plan.may_run_code)
    assert plan_id(again) == plan_id(plan)
    assert again.title == plan.title
    last = plan.members - 1
    assert again.config_of(last) == plan.config_of(last)


@pytest.mark.parametrize("path", READY, ids=lambda path: path.stem)
def test_ready_plans(path, tmp_path):
    assert_reloads_unchanged(load_plan(path, allow_python=True), tmp_path)


def test_changes_are_in_it(tmp_path):
    assert_reloads_unchanged(
        load_plan(READY[0], ["integration.samples=7", 'title="a: b # c"']), tmp_path
    )


@pytest.mark.parametrize("keep", ["traces", "{traces: [3, 1]}", "{traces: []}"])
def test_every_kind_of_axis(load, tmp_path, keep):
    plan = load(f"""\
title: "a: 'b' # ü"
base: visco-elastic.yaml
vary:
  body.mass: {{uniform: [40, 50]}}
  alone: {{zip: {{controller.K_t: {{scale: {{loguniform: [1, 2]}}}}}}}}
  controller.K_r: {{each: {{scale: {{logspace: [-7, 0, 3]}}}}}}
  both:
    each:
      zip:
        controller.L_r: {{scale: {{values: [1e-9, 2, 3]}}}}
        "gravity[2]": {{linspace: [-10, 1, 3]}}
design: latin-hypercube
members: 100
seed: 12345678901234567
keep: {keep}
""")
    assert_reloads_unchanged(plan, tmp_path)
