"""Protects `docs/sweeps.md`: its plans and error messages are as shown."""

import re
from pathlib import Path

import pytest

from rbstab.sweep.plan.designs import DESIGNS
from rbstab.sweep.plan.plan import MAX_MEMBERS
from rbstab.sweep.plan.plan_file import PlanFile, Spread

PAGE = (Path(__file__).parents[3] / "docs" / "sweeps.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)


@pytest.mark.parametrize("text", blocks("yaml"))
def test_plans(load, text):
    text = text.replace("../paper/case2_visco_elastic.yaml", "visco-elastic.yaml")
    base = "" if "base:" in text else "base: visco-elastic.yaml\n"
    assert load(base + text).members > 1


def test_the_error(complaints):
    expected = blocks("text")[0].strip()
    text = (
        "base: visco-elastic.yaml\nvary:\n  body.mass: {normal: [1, 2]}\n"
        "design: random\nmembers: 100000\nseed: 1\n"
    )
    assert complaints(text) == [expected.removeprefix("plan.yaml:")]


def test_everything_is_described():
    for word in (*Spread.model_fields, "member"):
        assert f"| `{{{word}: [" in PAGE
    for word in (*PlanFile.model_fields, *DESIGNS):
        assert f"`{word}`" in PAGE
    assert f"{MAX_MEMBERS:,}" in PAGE
    limits = [design.max_points for design in DESIGNS.values() if design.max_points]
    assert limits
    assert all(f"{limit:,}" in PAGE for limit in limits)
