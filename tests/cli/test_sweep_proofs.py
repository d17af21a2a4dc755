"""Protects `rbstab sweep` with `prove: motion`: what it prints of proofs."""

import json
from pathlib import Path

import pytest

PLAN = """\
title: Spins
base: good.yaml
vary:
  initial.angular_velocity[0]: {values: [1, 14, 16, 500]}
prove: {motion: {steps: 20}}
"""

SWEEP = ("sweep", "plan.yaml")


@pytest.mark.usefixtures("plan")
def test_the_proved_members_are_counted(rbstab, statuses):
    done = rbstab(*SWEEP, "--shard-size", "2", "--threads", "1")
    assert done.exit_code == 0, done.output
    said = "\n".join(statuses)
    assert "2 of 4 members proved, " in said
    assert "3 of 4 members proved, " in said
    assert " members/s, " in said
    (row,) = [line for line in done.stdout.splitlines() if "converge to a rest state" in line]
    assert "3 proved, 1 not decided" in row
    again = json.loads(rbstab(*SWEEP, "--json").stdout)
    assert again["convergence"] == {"proved": 3, "not decided": 1}
    assert len(list(Path("results/proofs").iterdir())) == 1
    assert "rbstab" in rbstab("report", "results/plan", "--format", "text").stdout


@pytest.mark.usefixtures("plan")
def test_a_plan_without_proofs_prints_nothing_of_them(rbstab, statuses):
    text = Path("plan.yaml").read_text()
    Path("plan.yaml").write_text(text[: text.index("prove:")])
    done = rbstab(*SWEEP, "--threads", "1", "--no-prove")
    assert "proved" not in done.stdout + done.stderr + "".join(statuses)
    assert json.loads(rbstab(*SWEEP, "--no-prove", "--json").stdout)["convergence"] == {}
