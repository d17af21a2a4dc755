"""Changes of the base by `--set` that no member would see are refused."""

import pytest
from support.configs import BY_VARIANT, plain

from rbstab.config.errors import ConfigError
from rbstab.sweep.plan.load import load_plan

VARIED = {
    "body.mass": {"values": [40, 41]},
    "controller.K_t": {"scale": {"values": [1, 2]}},
    "initial.angular_velocity[0]": {"values": [1, 2]},
    "initial.orientation[0]": {"values": [0.1]},
    "initial.orientation[1]": {"values": [0.2]},
    "initial.orientation[2]": {"values": [0.3]},
}
VARIANTS = {
    "controller.variant": {"values": ["visco-elastic", "embedded"]},
    "controller.K_d[0]": {"values": [5000, 6000]},
}


def loaded(*changes, vary=VARIED):
    return load_plan({"base": plain(BY_VARIANT["embedded"]), "vary": vary}, changes)


REFUSED = [
    (VARIED, ["body.mass=50"], ["body.mass"]),
    (VARIED, ["initial.angular_velocity[0]=5"], ["initial.angular_velocity[0]"]),
    (VARIED, ["initial.orientation=[0, 0, 0]"], ["initial.orientation"]),
    (
        VARIED,
        ["body.mass=50", "gravity=[0, 0, 9]", "initial.orientation[1]=0"],
        ["body.mass", "initial.orientation[1]"],
    ),
    (VARIANTS, ["controller.variant=free"], ["controller.variant"]),
    (VARIANTS, ["controller.K_d[0]=7000"], ["controller.K_d[0]"]),
]


@pytest.mark.parametrize(("vary", "changes", "keys"), REFUSED)
def test_keys_that_vary(vary, changes, keys):
    with pytest.raises(ConfigError) as caught:
        loaded(*changes, vary=vary)
    assert str(caught.value).splitlines() == [
        f"--set {key}:1:1: {key}: has no effect, because the plan varies it "
        "(expected a key that the plan does not vary)"
        for key in keys
    ]


SEEN = [
    # A key that is scaled, the other entries of a vector, and what does not vary.
    (VARIED, "controller.K_t=[1, 2, 3]", {(1.0, 2.0, 3.0), (2.0, 4.0, 6.0)}),
    (
        VARIED,
        "initial.angular_velocity=[0, 7, 8]",
        {(1.0, 7.0, 8.0), (2.0, 7.0, 8.0)},
    ),
    (VARIED, "gravity=[0, 0, 9]", {(0.0, 0.0, 9.0)}),
    (VARIED, "integration.engine=heyoka", {"heyoka"}),
    ({"body.mass": {"scale": {"values": [1, 2]}}}, "body.mass=10", {10.0, 20.0}),
]


@pytest.mark.parametrize(("vary", "change", "values"), SEEN)
def test_keys_that_members_see(vary, change, values):
    plan = loaded(change, vary=vary)
    seen = set()
    for number in range(plan.members):
        value = plan.config_of(number)
        for name in change.partition("=")[0].split("."):
            value = getattr(value, name)
        seen.add(value)
    assert seen == values


def test_a_key_that_only_one_variant_has():
    assert loaded("controller.K_d[1]=7000", vary=VARIANTS).config_of(3).controller.K_d[1] == 7000
