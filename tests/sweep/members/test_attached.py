"""Protects sweeps of attached bodies: the position of each member follows from its own numbers."""

from typing import Any

import numpy as np
import pytest
from support.paper_runs import paper_config
from support.pose import attitude

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.sweep.members.binding import Binding
from rbstab.sweep.plan.load import load_plan, plan_data
from rbstab.sweep.plan.plan import plan_id

SHORT: dict[str, Any] = {"duration": 0.4, "samples": 21, "rtol": 1e-10, "engine": "heyoka"}
R = np.array([0.15, 0.10, -0.42])
VARY = {
    "initial.orientation[0]": {"uniform": [-0.5, 0.5]},
    "initial.orientation[1]": {"uniform": [-0.5, 0.5]},
    "body.mass": {"uniform": [20, 60]},
    "body.contact_point[2]": {"uniform": [-0.6, 0.2]},
}


def base_of(variant="visco-elastic", **more):
    base = paper_config(variant, with_gravity=True, **SHORT)
    initial = {key: value for key, value in base["initial"].items() if key != "position"}
    controller = base["controller"] | more
    return base | {"initial": initial | {"attached": True}, "controller": controller}


def plan_of(base, vary=VARY, members=6):
    return load_plan(
        {"base": base, "vary": vary, "design": "random", "members": members, "seed": 3}
    )


def test_each_member_starts_on_its_anchor():
    plan = plan_of(base_of(anchor="equilibrium"))
    values = plan.values(0, plan.members)
    _, starts = Binding(plan, "visco-elastic").parameters_and_starts(values)
    base = plan.base_of("visco-elastic")
    K_t, gravity = np.diag(base.controller.K_t), np.array(base.gravity)
    assert gravity.any()
    for k in range(plan.members):
        Theta = starts[:3, k]
        assert Theta[0] == values["initial.orientation[0]"][k]
        point = np.array([*R[:2], values["body.contact_point[2]"][k]])
        anchor = np.linalg.solve(K_t, values["body.mass"][k] * gravity)
        expected = anchor + point - attitude(Theta) @ point
        np.testing.assert_allclose(starts[6:9, k], expected, atol=1e-15)


def test_variants_from_the_same_attached_start():
    """The held body is always attached, so the base may say it for all variants."""
    variants = {"each": {"values": ["permanent", "visco-elastic"]}}
    plan = plan_of(base_of(), {"controller.variant": variants, **VARY}, members=2)
    loaded = load_plan(plan_data(plan))
    assert plan_id(loaded) == plan_id(plan)
    held, tied = load_config(plan.config_of(0)), load_config(plan.config_of(2))
    assert held.initial.orientation == tied.initial.orientation
    assert held.initial.attached is None
    assert tied.initial.attached is True


@pytest.mark.parametrize(
    ("key", "values", "message"),
    [
        ("initial.position[0]", {"uniform": [0, 1]}, "follows from .*attached"),
        ("initial.position", {"scale": {"uniform": [0, 1]}}, "follows from .*attached"),
        ("initial.attached", {"values": [0, 1]}, "is true in the base"),
    ],
)
def test_what_of_an_attached_body_cannot_vary(key, values, message):
    with pytest.raises(ConfigError, match=message):
        plan_of(base_of(), {key: values}, members=2)
