"""Protects the messages about a file or an option that is not what a command takes: they say what
it is and name the command that takes it.
"""

from pathlib import Path

import pytest
from cli.conftest import GOOD, Invoke

PLAN = """\
title: Two members
base: good.yaml
vary:
  initial.angular_velocity[0]: {linspace: [1, 2, 2]}
"""

BLANK = "with a blank"


@pytest.fixture
def files(folder: Path) -> Path:
    """A config and a plan in the working folder, and both in a folder with a blank in its name."""
    (folder / BLANK).mkdir()
    for place in (folder, folder / BLANK):
        (place / "good.yaml").write_text(GOOD)
        (place / "plan.yaml").write_text(PLAN)
    return folder


def test_plans_are_checked_too(files: Path, rbstab: Invoke) -> None:
    done = rbstab("check", "plan.yaml", "good.yaml")
    assert done.exit_code == 0
    plan, config = done.stdout.splitlines()
    assert plan.startswith("plan.yaml: valid: the plan of a sweep, 2 members, free, sweep id ")
    assert config.startswith("good.yaml: valid: free, coordinates Z")
    Path("wrong.yaml").write_text(PLAN.replace("initial.angular", "initial.anglar"))
    Path("bad.yaml").write_text(GOOD.replace("mass: 41", "mass: -41"))
    done = rbstab("check", "wrong.yaml", "bad.yaml", "good.yaml")
    assert done.exit_code == 2
    assert done.stdout == ""
    first, second = done.stderr.splitlines()
    assert first.startswith("wrong.yaml:4:3: vary.initial.anglar_velocity[0]: is not in the base")
    assert second.startswith("bad.yaml:2:14: body.mass: is -41")


def test_the_largest_tolerance_of_a_driven_body_has_a_reason(files: Path, rbstab: Invoke) -> None:
    push = "{push: {kind: input, quantity: couple, direction: [0, 0, 1], amplitude: 3, signal: "
    driven = GOOD + f"schema_version: 2\nelements: {push}{{kind: constant}}}}}}\n"
    Path("driven.yaml").write_text(driven)
    done = rbstab("stability", "driven.yaml", "--no-run", LARGEST, "body.mass")
    assert done.exit_code == 0
    assert "none is proved. At ±0.015625 % it is not decided: an input" in done.stdout
