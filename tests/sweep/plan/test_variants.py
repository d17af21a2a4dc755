"""Protects plans with several variants, from one base that holds the keys of all of them."""

import numpy as np
import pytest
from support.configs import EMBEDDED, PERMANENT, edited, plain

from rbstab.config.load import load_config
from rbstab.config.schema import VARIANTS, model_of
from rbstab.sweep.plan.load import load_plan

UNION = edited("  K_t:", "  K_s: [1, 2, 3]\n  surface: position\n  K_t:", EMBEDDED)
UNION = edited("initial:", "initial:\n  connector_state: [0, 0, 0.1]\n  position: [1, 0, 0]", UNION)


def plan_of(vary, base=UNION, **more):
    return load_plan({"base": plain(base), "vary": vary, **more})


def test_keys_that_a_variant_does_not_have_are_left_out():
    plan = plan_of({"controller.variant": {"values": list(VARIANTS)}})
    assert plan.variants == tuple(VARIANTS)
    for number, variant in enumerate(VARIANTS):
        config = plan.config_of(number)
        assert type(config) is model_of(variant)
        assert config.controller.variant == variant
        assert plan.base_of(variant).controller == config.controller
        data = plain(UNION) | {"title": f"Case, member {number}"}
        data["controller"] |= {"variant": variant}
        for section in ("controller", "initial"):
            model = model_of(variant).model_fields[section].annotation
            assert model is not None
            fields = model.model_fields
            data[section] = {key: value for key, value in data[section].items() if key in fields}
        assert config == load_config(data)
    sliding = plan.config_of(4).controller
    assert (sliding.K_s, sliding.surface, plan.config_of(2).controller.K_c) == (
        (1.0, 2.0, 3.0),
        "position",
        (12300.0, 12300.0, 9840.0),
    )


def test_the_variant_of_the_base_does_not_count():
    vary = {"controller.variant": {"values": ["permanent", "free"]}}
    rigid = edited("variant: embedded", "variant: rigid", UNION)
    without = edited("  variant: embedded\n", "", UNION)
    for base in (rigid, without):
        assert plan_of(vary, base).config_of(1) == plan_of(vary).config_of(1)


def test_a_varied_key_is_without_effect_where_the_variant_has_none():
    vary = {
        "initial.position[0]": {"values": [3, 4]},
        "controller.variant": {"values": ["permanent", "free"]},
    }
    plan = plan_of(vary)
    held, free, other_held, _ = (plan.config_of(i) for i in range(4))
    assert held.initial == other_held.initial
    assert free.initial.position == (3.0, 0.0, 0.0)
    assert [varied.key for varied in plan.varied_keys_of("free")] == ["initial.position[0]"]
    assert plan.varied_keys_of("permanent") == ()


def test_the_same_points_for_each_variant():
    plan = plan_of(
        {
            "initial.angular_velocity[0]": {"normal": [0, 1]},
            "controller.variant": {"each": {"values": ["free", "embedded"]}},
        },
        design="random",
        members=10,
        seed=1,
    )
    values = plan.values(0, 20)
    assert values["controller.variant"].tolist() == ["free"] * 10 + ["embedded"] * 10
    spin = values["initial.angular_velocity[0]"]
    assert (spin[:10] == spin[10:]).all()
    assert len(np.unique(spin)) == 10
    assert plan.config_of(3).initial.angular_velocity == plan.config_of(13).initial.angular_velocity


def test_a_variant_that_moves_with_a_number():
    together = {
        "controller.variant": {"values": ["free", "embedded"]},
        "controller.K_c": {"scale": {"values": [1, 2]}},
    }
    plan = plan_of({"both": {"zip": together}})
    assert plan.config_of(0).controller.variant == "free"
    assert plan.config_of(1).controller.K_c == (24600.0, 24600.0, 19680.0)
    drawn = plan_of({"both": {"zip": together}}, design="sobol", members=64, seed=1)
    names = drawn.values(0, 64)["controller.variant"]
    assert names.dtype == object
    assert sorted(names) == ["embedded"] * 32 + ["free"] * 32


VARIED = "vary:\n  controller.variant: {values: [visco-elastic, embedded, sliding]}\n"
TWO = "vary:\n  controller.variant: {values: [embedded, permanent]}\n"
MISSING = [
    f"visco-elastic.yaml:7:3: controller.{key}: is missing for the variant {variant}"
    " (it is required)"
    for key, variant in (
        ("K_d", "embedded"),
        ("K_s", "sliding"),
        ("L_d", "embedded"),
        ("surface", "sliding"),
    )
]

WRONG = [
    # The base is not judged if its variants are unknown.
    (
        "base: w.yaml\nvary:\n  controller.variant: {values: [permanent, fre]}\n",
        (),
        [
            "3:44: vary.controller.variant.values[1]: is the text 'fre' (expected a number, or"
            f" one of {', '.join(VARIANTS)}; did you mean free?)"
        ],
    ),
    (f"base: visco-elastic.yaml\n{VARIED}", (), MISSING),
    # A key that only the wrong variant has is not called unknown.
    (f"base: visco-elastic.yaml\n{VARIED}  controller.K_d[0]: {{values: [1]}}\n", (), MISSING),
    # What is wrong for all variants is told once.
    (
        f"base: embedded.yaml\n{TWO}",
        ("body.mass=-1", "controller.Kt=1"),
        [
            "--set body.mass:1:11: body.mass: is -1 (expected a number greater than 0)",
            "--set controller.Kt:1:1: controller.Kt: is unknown (did you mean K_t?)",
        ],
    ),
    (
        f"base: embedded.yaml\n{TWO}  controller.anchor: {{values: [1]}}\n",
        (),
        [
            "4:3: vary.controller.anchor: is the text 'origin' in the base"
            " (expected a number, or controller.variant)"
        ],
    ),
    (
        f"base: w.yaml\n{TWO}",
        (),
        [
            f"w.yaml:{len(EMBEDDED.splitlines()) + 1}:16: integration.coordinates:"
            " is the text 'W' for the variant permanent (expected reduced, manifold or quaternion)"
        ],
    ),
]


@pytest.mark.parametrize(("text", "changes", "expected"), WRONG)
def test_wrong_variants(complaints, tmp_path, text, changes, expected):
    (tmp_path / "w.yaml").write_text(EMBEDDED + "  coordinates: W\n")
    assert complaints(text, *changes) == expected


@pytest.mark.parametrize("design", ["grid", "random"])
def test_members_are_checked_for_the_variants_that_have_the_key(complaints, design, tmp_path):
    (tmp_path / "union.yaml").write_text(UNION)
    more = "" if design == "grid" else "design: random\nmembers: 100\nseed: 1\n"
    text = (
        "base: union.yaml\nvary:\n  controller.variant: {values: [free, embedded]}\n"
        "  controller.K_c[0]: {values: [1, 2, -3]}\n"
    )
    (message,) = complaints(text + more)
    text_of = message.removeprefix("4:3: vary.controller.K_c[0]: at member ")
    assert text_of != message
    number = int(text_of.split()[0])
    assert "controller.K_c[0] is -3 (expected a number greater than 0)" in text_of
    (tmp_path / "good.yaml").write_text((text + more).replace("-3", "3"))
    good = load_plan(tmp_path / "good.yaml")
    values = {key: column[0] for key, column in good.values(number, number + 1).items()}
    assert values == {"controller.variant": "embedded", "controller.K_c[0]": 3.0}


def test_members_of_which_some_read_euler_angles_have_the_same_coordinates():
    base = edited("K_r: [400, 400, 320]", "K_r: [0, 0, 0]", PERMANENT)
    fixed = plan_of({"body.mass": {"values": [40, 41]}}, base)
    assert fixed.in_quaternions
    varied = plan_of({"controller.K_r[0]": {"values": [0, 5]}}, base)
    assert not varied.in_quaternions
    for plan, coordinates in ((fixed, "quaternion"), (varied, "reduced")):
        for number in range(2):
            assert plan.config_of(number).integration.coordinates == coordinates
