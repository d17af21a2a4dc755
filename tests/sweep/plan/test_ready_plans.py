"""Protects the plans of `configs/sweeps`: all exist, can run, and vary what they claim."""

from pathlib import Path

import numpy as np
import pytest

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.sweep.plan.load import load_plan

ROOT = Path(__file__).parents[3] / "configs"
PLANS = {path.stem: path for path in (ROOT / "sweeps").glob("*.yaml")}

MEMBERS = {
    "stability_map_visco_elastic": 201 * 201,
    "stability_map_permanent": 201 * 201,
    "rotational_stiffness": 101 * 40,
    "robustness": 2**14,
    "connector_scale": 61 * 61,
    "variants": 5 * 1000,
    "proved_spins_visco_elastic": 21 * 21,
    "motors": 31 * 26,
    "strut_stiffness": 9 * 7,
    "shaken": 39 * 45,
    "gusts": 4 * 100,
    "gusts_bound": 600,
    "cubic_spring": 13 * 10,
}


def test_there_are_no_others():
    assert set(PLANS) == set(MEMBERS)


@pytest.mark.parametrize("name", MEMBERS)
def test_its_members_can_be_run(name):
    plan = load_plan(PLANS[name], allow_python=True)
    assert plan.members == MEMBERS[name]
    assert PLANS[name].read_text().startswith("# ")
    for number in np.linspace(0, plan.members - 1, 7).astype(int):
        assert np.isfinite(problem_of(plan.config_of(int(number))).start).all()


def test_the_maps_have_the_paper_in_their_range():
    for name, case in [
        ("stability_map_visco_elastic", "case2_visco_elastic"),
        ("stability_map_permanent", "case1_permanent"),
    ]:
        plan, base = load_plan(PLANS[name]), load_config(ROOT / "paper" / f"{case}.yaml")
        # Spins 16 and 32 are entries 140 and 180 of lists from -40 in steps of 0.4.
        member = plan.config_of(140 * 201 + 180)
        assert member.initial.angular_velocity == pytest.approx(base.initial.angular_velocity)
        assert member.controller == base.controller
        assert plan.config_of(100 * 201 + 100).initial.angular_velocity[:2] == (0.0, 0.0)


def test_robustness_covers_thirty_per_cent_of_everything():
    plan = load_plan(PLANS["robustness"])
    base = plan.base_of("visco-elastic")
    fields = set(type(base.controller).model_fields) - {"connector_actuators"}
    gains = {f"controller.{key}" for key in fields if "_" in key}
    values = plan.values(0, plan.members)
    assert set(values) == gains | {"body.inertia"}
    for factors in values.values():
        assert 0.7 < factors.min() < 0.7001
        assert 1.2999 < factors.max() < 1.3
        assert factors.mean() == pytest.approx(1.0, abs=1e-4)
