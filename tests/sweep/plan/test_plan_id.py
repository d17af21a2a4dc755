"""Protects the identity of a plan: it changes exactly when members or traces change."""

from textwrap import indent

import pytest
from support.configs import VISCO_ELASTIC, edited
from support.fresh_process import printed_with_hash_seeds

from rbstab.sweep.plan.plan import plan_id

PLAN = """\
title: Plan
base: visco-elastic.yaml
vary:
  body.mass: {uniform: [40, 50]}
  controller.K_r: {each: {scale: {linspace: [1, 2, 3]}}}
  both: {zip: {controller.L_r: {scale: {values: [1, 2]}}, gravity[2]: {normal: [-10, 1]}}}
design: sobol
members: 100
seed: 1
keep: summary
""".replace("gravity[2]", "'gravity[2]'")


SAME = [
    edited("title: Plan", "title: Other", PLAN),
    edited("title: Plan\n", "", PLAN),
    edited("keep: summary\n", "", PLAN),
    edited("[40, 50]", "[40.0, 5e1]", PLAN),
    PLAN + "schema_version: 1\n",
    edited("visco-elastic.yaml", "other.yaml", PLAN),
    edited(" visco-elastic.yaml", "\n" + indent(VISCO_ELASTIC, "  "), PLAN),
]


@pytest.mark.parametrize("text", SAME)
def test_same(load, tmp_path, text):
    other = VISCO_ELASTIC.replace("41.0", "4.1e1") + "  rtol: 1e-12\n"
    (tmp_path / "other.yaml").write_text(other)
    assert text != PLAN
    assert plan_id(load(text)) == plan_id(load(PLAN))


def test_other_spellings_of_keep(load):
    for keeps in (("traces", "{traces: {every: 1}}"), ("{traces: [3, 1]}", "{traces: [1, 3, 3]}")):
        texts = [edited("keep: summary", f"keep: {keep}", PLAN) for keep in keeps]
        assert len({plan_id(load(text)) for text in texts}) == 1


def test_keys_of_the_base_without_effect_do_not_count(load, tmp_path):
    names = set()
    for name, more in [("one", ""), ("other", "  method: Radau\n  atol: 1e-6\n")]:
        (tmp_path / f"{name}.yaml").write_text(VISCO_ELASTIC + "  engine: heyoka\n" + more)
        names.add(plan_id(load(edited("visco-elastic.yaml", f"{name}.yaml", PLAN))))
    assert len(names) == 1


CHANGES = [
    ("[40, 50]", "[40, 50.000000000000007]"),
    ("uniform: [40", "loguniform: [40"),
    ("body.mass", "body.contact_point[0]"),
    ("{each: {scale: {linspace: [1, 2, 3]}}}", "{scale: {linspace: [1, 2, 3]}}"),
    ("[1, 2, 3]", "[1, 2, 4]"),
    ("linspace: [1, 2, 3]", "values: [1, 1.5, 2]"),
    ("controller.K_r:", "controller.K_t:"),
    (
        "controller.K_r: {each: {scale: {linspace: [1, 2, 3]}}}",
        "controller.K_r[0]: {each: {linspace: [1, 2, 3]}}",
    ),
    ("{scale: {values: [1, 2]}}", "{scale: {values: [2, 1]}}"),
    ("both:", "together:"),
    ("sobol", "random"),
    ("sobol", "latin-hypercube"),
    ("members: 100", "members: 101"),
    ("seed: 1", "seed: 2"),
    ("keep: summary", "keep: traces"),
    ("keep: summary", "keep: {traces: [1]}"),
    ("keep: summary", "keep: {traces: [2]}"),
    ("keep: summary", "keep: {traces: {every: 2}}"),
    ("visco-elastic.yaml", "embedded.yaml"),
]


def test_every_change_makes_another_sweep(load):
    names = [plan_id(load(PLAN)), *(plan_id(load(edited(*c, PLAN))) for c in CHANGES)]
    names += [
        plan_id(load(PLAN, change)) for change in ("gravity=[0, 0, 7]", "integration.rtol=1e-9")
    ]
    lines = PLAN.splitlines(keepends=True)
    turned = "".join([*lines[:3], lines[4], lines[3], *lines[5:]])
    names.append(plan_id(load(turned)))
    assert len(set(names)) == len(names)


def test_variants_count(load):
    text = "base: embedded.yaml\nvary:\n  controller.variant: {values: [VARIANTS]}\n"
    names = ["free, embedded", "embedded, free", "free, permanent", "free"]
    assert len({plan_id(load(text.replace("VARIANTS", name))) for name in names}) == 4


def test_stable_across_processes(write):
    path = write(PLAN)
    script = (
        "import sys; from rbstab.sweep.plan.load import load_plan;"
        "from rbstab.sweep.plan.plan import plan_id; print(plan_id(load_plan(sys.argv[1])))"
    )
    assert len(printed_with_hash_seeds(script, path)) == 1


def test_stable_across_versions(load):
    """Stored sweeps resume by this id: it may change only with the version of plans."""
    assert plan_id(load(PLAN)) == "4accb79fd2c6e36e4d51b51ac461c426"
