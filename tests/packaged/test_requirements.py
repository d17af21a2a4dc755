"""Protects the requirements of the package: the lower bounds that the workflow tests are those of
pyproject.toml, and the versions of Python are those that it names.
"""

import re
import tomllib
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
USED_BY_USERS = ("cluster", "report", "second", "table", "xarray")
"""The extras that are tested with their oldest versions; the others are tools of developers."""


def bounds():
    """Return the lower bound of each requirement of users."""
    extras = PROJECT["optional-dependencies"]
    wanted = [*PROJECT["dependencies"], *(line for name in USED_BY_USERS for line in extras[name])]
    matches = [re.match(r"([\w.-]+)>=([\d.]+)(?:;|$)", line) for line in wanted]
    assert None not in matches
    return {match[1].lower(): match[2] for match in matches if match}


def exact():
    """Return the exact versions of the constraints."""
    lines = (ROOT / ".github" / "oldest.txt").read_text(encoding="utf-8").splitlines()
    return dict(line.split("==") for line in lines if "==" in line)


def padded(version):
    """Return a version as numbers; 2.0 is 2.0.0."""
    parts = [int(part) for part in version.split(".")]
    return (*parts, *[0] * (3 - len(parts)))


def workflow_versions():
    """Return the versions of Python in the workflow, such as `3.11`, the oldest first."""
    text = (ROOT / ".github" / "workflows" / "tests.yml").read_text(encoding="utf-8")
    versions: list[str] = yaml.safe_load(text)["jobs"]["systems"]["strategy"]["matrix"]["python"]
    return sorted(versions, key=padded)


def test_the_lower_bounds_are_tested():
    tested = {name: padded(version) for name, version in exact().items()}
    assert tested == {name: padded(version) for name, version in bounds().items()}


def test_each_named_python_is_tested():
    named = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["classifiers"]))
    tested = workflow_versions()
    assert named
    assert set(named) <= set(tested)
    assert PROJECT["requires-python"] == f">={tested[0]}" == f">={named[0]}"
