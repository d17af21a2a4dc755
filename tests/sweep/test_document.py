"""What docs/sweeps.md shows is what the program takes and says."""

import re
from pathlib import Path

import pytest

from rbstab.sweep.load import KEYS, load_plan
from rbstab.sweep.plan import MOST_LATIN_MEMBERS, MOST_MEMBERS
from rbstab.sweep.read_distribution import WORDS

PAGE = (Path(__file__).parents[2] / "docs" / "sweeps.md").read_text()


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
    for word in WORDS:
        assert f"| `{{{word}: [" in PAGE
    for key in KEYS:
        assert f"`{key}`" in PAGE
    assert f"{MOST_MEMBERS:,}" in PAGE
    assert f"{MOST_LATIN_MEMBERS:,}" in PAGE


def test_the_python(monkeypatch):
    monkeypatch.chdir(Path(__file__).parents[2])
    names = {}
    exec(blocks("python")[0], names)  # noqa: S102
    assert names["plan"].members == 16384
    assert names["config"].body.mass == 50.0
    assert load_plan("configs/sweeps/robustness.yaml").config_of(17).body.mass == 41.0
