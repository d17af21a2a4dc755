"""Protects the run ids of members: they equal the run ids of their configs."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbstab.config.load import run_id
from rbstab.sweep.members import identity
from rbstab.sweep.members.identity import run_ids
from rbstab.sweep.plan.load import load_plan

READY = sorted((Path(__file__).parents[3] / "configs" / "sweeps").glob("*.yaml"))
PLANS = {path.stem: load_plan(path, allow_python=True) for path in READY}


def run_ids_of_configs(plan, start, stop):
    return [run_id(plan.config_of(index)).encode() for index in range(start, stop)]


@pytest.mark.parametrize("name", PLANS)
@settings(deadline=None, max_examples=10)
@given(data=st.data())
def test_ready_plans(name, data):
    plan = PLANS[name]
    start = data.draw(st.integers(0, plan.members - 1))
    stop = min(start + data.draw(st.integers(0, 3)), plan.members)
    assert run_ids(plan, start, stop).tolist() == run_ids_of_configs(plan, start, stop)


def test_over_the_border_of_two_variants():
    plan = PLANS["variants"]
    assert run_ids(plan, 2998, 3003).tolist() == run_ids_of_configs(plan, 2998, 3003)


NUMBERS = st.one_of(
    st.floats(-1e3, 1e3), st.sampled_from([0.0, -0.0, 1e-300, 1e16, 1e17, 0.1, 5e-324, 3.0])
)


@settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(spins=st.lists(NUMBERS, min_size=1, max_size=4), factor=st.floats(0.1, 10))
def test_any_number(load, spins, factor):
    plan = load(f"""\
base: visco-elastic.yaml
vary:
  initial.angular_velocity[1]: {{values: {[float(x) for x in spins]}}}
  initial.angular_velocity[0]: {{scale: {{values: [{-factor!r}, 0, {factor!r}]}}}}
  controller.K_r: {{scale: {{values: [{factor!r}]}}}}
""")
    assert run_ids(plan, 0, plan.members).tolist() == run_ids_of_configs(plan, 0, plan.members)


@pytest.mark.parametrize("title", ['100 % öäü \\\\ \\" 😀', "x" * 200, "%s %r %(a)s", "ü" * 200])
def test_any_title(load, tmp_path, title):
    text = """\
base: free.yaml
vary:
  body.mass: {linspace: [1, 2, 120]}
"""
    plan = load(text, f'title="{title}"')
    assert run_ids(plan, 8, 12).tolist() == run_ids_of_configs(plan, 8, 12)
    assert run_ids(plan, 98, 102).tolist() == run_ids_of_configs(plan, 98, 102)


def test_full_matrices_and_entries(load):
    plan = load(
        """\
base: visco-elastic.yaml
vary:
  a: {zip: {"controller.K_r[0][1]": {values: [1, 2]}, "controller.K_r[1][0]": {values: [1, 2]}}}
  controller.L_r: {scale: {values: [1, 3]}}
  controller.K_c[2]: {values: [5, 7]}
""",
        "controller.K_r=[[400,0,0],[0,400,0],[0,0,320]]",
    )
    assert run_ids(plan, 0, 8).tolist() == run_ids_of_configs(plan, 0, 8)


@pytest.mark.parametrize(
    "broken", [lambda *_: None, lambda *_: identity._TextTemplate("", ("",), ())]
)
def test_what_cannot_be_filled_in_is_found_slowly(monkeypatch, broken):
    monkeypatch.setattr(identity, "_template", broken)
    plan = PLANS["variants"]
    assert run_ids(plan, 0, 3).tolist() == run_ids_of_configs(plan, 0, 3)


def test_each_of_many_is_another():
    ids = run_ids(PLANS["robustness"], 0, 5000)
    assert (ids.shape, ids.dtype) == ((5000,), np.dtype("S32"))
    assert len(set(ids.tolist())) == 5000
