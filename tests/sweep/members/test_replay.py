"""Protects the config of a member: it equals the config that a user would write for it."""

import pytest
from support.configs import BY_VARIANT, EMBEDDED, VISCO_ELASTIC, edited, plain

from rbstab.config.load import load_config, run_id
from rbstab.sweep.plan.load import load_plan


def by_hand(text, number, *changes):
    """Return a config with the title of a member, changed as by `--set`."""
    return load_config(plain(text), [*changes, f"title=Case, member {number}"])


def test_numbers(load):
    plan = load("""\
base: visco-elastic.yaml
vary:
  body.mass: {values: [40, 50]}
  controller.K_r[1]: {linspace: [100, 300, 3]}
  initial.position[2]: {values: [0.5]}
""")
    expected = by_hand(
        VISCO_ELASTIC, 4, "body.mass=50", "controller.K_r[1]=200", "initial.position[2]=0.5"
    )
    assert plan.config_of(4) == expected
    assert run_id(plan.config_of(4)) == run_id(expected)
    assert plan.config_of(0).body.mass == 40.0


def test_factors_of_numbers_vectors_and_matrices(load, tmp_path):
    matrix = "[[60, 1, 0], [1, 60, 0], [0, 0, 42]]"
    text = edited("[60, 60, 42]", matrix)
    (tmp_path / "full.yaml").write_text(text)
    plan = load("""\
base: full.yaml
vary:
  body.mass: {scale: {values: [0.1, 3]}}
  initial.angular_velocity: {scale: {values: [-1, 0.5]}}
  gains:
    zip: {controller.K_t: {scale: {values: [2]}}, controller.L_r: {scale: {values: [3]}}}
""")
    changes = [
        "body.mass=123",
        "initial.angular_velocity=[-16, -32, 16]",
        "controller.K_t=[8200, 8200, 6560]",
        "controller.L_r=[[180, 3, 0], [3, 180, 0], [0, 0, 126]]",
    ]
    assert plan.config_of(2) == by_hand(text, 2, *changes)
    assert plan.config_of(0).body.mass == 0.1 * 41.0


def test_entries_of_a_matrix(load, tmp_path):
    text = edited("[60, 60, 42]", "[[60, 1, 0], [1, 60, 0], [0, 0, 42]]")
    (tmp_path / "full.yaml").write_text(text)
    plan = load("""\
base: full.yaml
vary:
  controller.L_r[2][2]: {values: [40, 50]}
  coupling:
    zip:
      controller.L_r[0][1]: {values: [1, 2, 3]}
      controller.L_r[1][0]: {values: [1, 2, 3]}
""")
    expected = by_hand(text, 5, "controller.L_r=[[60, 3, 0], [3, 60, 0], [0, 0, 50]]")
    assert plan.config_of(5) == expected


def test_defaults_of_the_base_may_vary(load):
    plan = load("""\
base: embedded.yaml
vary:
  gravity[2]: {values: [-10]}
  initial.connector_state[1]: {values: [0.25]}
  initial.velocity[0]: {values: [1]}
""")
    changes = ["gravity=[0,0,-10]", "initial.connector_state=[0,0.25,0]", "initial.velocity[0]=1"]
    assert plan.config_of(0) == by_hand(EMBEDDED, 0, *changes)


def test_everything_else_is_that_of_the_base(load, tmp_path):
    text = (
        edited("  K_t:", "  anchor: equilibrium\n  K_t:")
        + "  engine: heyoka\n  method: Radau\n  coordinates: W\n"
        + "gravity: [0, 0, -1]\nreference: {source: a, final: {velocity: [1, 2, 3]}}\n"
    )
    (tmp_path / "base.yaml").write_text(text)
    plan = load("base: base.yaml\nvary:\n  body.mass: {values: [5]}\n")
    assert plan.config_of(0) == by_hand(text, 0, "body.mass=5")
    assert plan.base_of("visco-elastic") == load_config(plain(text))


def test_changes_of_the_base(load):
    text = "base: visco-elastic.yaml\nvary:\n  controller.K_r: {scale: {values: [2]}}\n"
    plan = load(text, "body.mass=7", "controller.K_r=[1, 2, 3]")
    expected = by_hand(VISCO_ELASTIC, 0, "body.mass=7", "controller.K_r=[2, 4, 6]")
    assert plan.config_of(0) == expected
    assert load(text, *["body.mass=7"]).config_of(0).body.mass == 7.0
    assert load_plan(plan_data(), "body.mass=8").config_of(0).body.mass == 8.0


def plan_data():
    return {"base": plain(), "vary": {"controller.K_t[0]": {"values": [1.5]}}}


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_values_of_a_member_are_those_of_the_sweep(load, variant):
    plan = load(f"""\
base: {variant}.yaml
vary:
  body.mass: {{normal: [50, 1]}}
  controller.L_t: {{scale: {{loguniform: [0.1, 10]}}}}
  initial.orientation[1]: {{uniform: [-1, 1]}}
design: random
members: 300
seed: 5
""")
    values = plan.values(0, 300)
    for number in (0, 17, 299):
        config = plan.config_of(number)
        assert config.body.mass == values["body.mass"][number]
        assert config.controller.L_t[2] == 140.0 * values["controller.L_t"][number]
        assert config.initial.orientation[1] == values["initial.orientation[1]"][number]


def test_the_title_says_which_member(load):
    text = "title: Plan\nbase: free.yaml\nvary:\n  body.mass: {linspace: [1, 2, 12]}\n"
    assert load(text).config_of(11).title == "Case, member 11"
    long = load(text, f"title={'x' * 200}").config_of(11).title
    assert long == "x" * 189 + ", member 11"


def test_members_do_not_share_what_they_are_made_of(load):
    plan = load("base: free.yaml\nvary:\n  controller.K_t: {scale: {values: [2, 3]}}\n")
    first = plan.config_of(0)
    plan.config_of(1)
    assert plan.config_of(0) == first
    assert plan.base_of("free").controller.K_t == (4100.0, 4100.0, 3280.0)
