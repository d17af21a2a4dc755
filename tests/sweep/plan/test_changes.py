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


def loaded(*changes, vary=VARIED, base="embedded"):
    return load_plan({"base": plain(BY_VARIANT[base]), "vary": vary}, changes)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ("body.mass=50", "body.mass"),
        ("initial.angular_velocity[0]=5", "initial.angular_velocity[0]"),
        ("initial.orientation=[0, 0, 0]", "initial.orientation"),
        ("initial.orientation[1]=0", "initial.orientation[1]"),
    ],
)
def test_a_key_that_varies(change, key):
    with pytest.raises(ConfigError) as caught:
        loaded(change)
    assert str(caught.value) == (
        f"--set {key}:1:1: {key}: has no effect, because the plan varies it "
        "(expected a key that the plan does not vary)"
    )


def test_every_such_change_is_named():
    with pytest.raises(ConfigError) as caught:
        loaded("body.mass=50", "gravity=[0, 0, 9]", "initial.orientation[1]=0")
    assert [problem.key for problem in caught.value.problems] == [
        "body.mass",
        "initial.orientation[1]",
    ]


@pytest.mark.parametrize("variants", [["free", "permanent"], ["embedded"]])
def test_the_variant(variants):
    with pytest.raises(ConfigError, match=r"controller.variant: has no effect, because the plan"):
        loaded("controller.variant=free", vary={"controller.variant": {"values": variants}})


def test_a_scaled_key_is_changed():
    plan = loaded("controller.K_t=[1, 2, 3]")
    found = {plan.config_of(number).controller.K_t for number in range(plan.members)}
    assert found == {(1.0, 2.0, 3.0), (2.0, 4.0, 6.0)}


def test_a_scaled_number_is_changed():
    plan = loaded("body.mass=10", vary={"body.mass": {"scale": {"values": [1, 2]}}})
    assert [plan.config_of(number).body.mass for number in range(2)] == [10.0, 20.0]


def test_the_other_entries_of_a_vector_are_changed():
    plan = loaded("initial.angular_velocity=[0, 7, 8]")
    assert {plan.config_of(k).initial.angular_velocity for k in range(plan.members)} == {
        (1.0, 7.0, 8.0),
        (2.0, 7.0, 8.0),
    }


def test_a_key_that_only_one_variant_has():
    """The change has an effect on the variants that do not vary the key, if there are any."""
    vary = {
        "controller.variant": {"values": ["visco-elastic", "embedded"]},
        "controller.K_d[0]": {"values": [5000, 6000]},
    }
    plan = loaded("controller.K_d[1]=7000", vary=vary)
    embedded = next(k for k in range(plan.members) if "embedded" in str(plan.config_of(k)))
    assert plan.config_of(embedded).controller.K_d[1] == 7000
    with pytest.raises(ConfigError, match="has no effect, because the plan varies it"):
        loaded("controller.K_d[0]=7000", vary=vary)


def test_keys_that_do_not_vary():
    config = loaded("gravity=[0, 0, 9]", "integration.engine=heyoka").config_of(0)
    assert config.gravity == (0.0, 0.0, 9.0)
    assert config.integration.engine == "heyoka"
