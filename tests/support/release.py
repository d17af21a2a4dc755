"""What a tag must agree with before a release is made of it; and the notes of the release.

`python -m support.release TAG` prints the notes, or what disagrees, with exit code 1.
"""

import re
import sys
import tomllib
from pathlib import Path

import click
import yaml

ROOT = Path(__file__).resolve().parents[2]


def problems(tag, root=ROOT):
    """Return what disagrees with a tag such as v1.2.3; nothing if a release may be made of it."""
    version = tag.removeprefix("v")
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = yaml.safe_load((root / "CITATION.cff").read_text(encoding="utf-8"))
    disagreements = [] if tag.startswith("v") else [f"the tag {tag} does not begin with v"]
    for file, stated in (("pyproject.toml", project), ("CITATION.cff", citation)):
        if str(stated["version"]) != version:
            disagreements.append(f"{file} has version {stated['version']}, and the tag is {tag}")
    if "date-released" not in citation:
        disagreements.append("CITATION.cff has no date-released")
    if not notes(tag, root):
        disagreements.append(f"CHANGELOG.md has no section {version} with changes")
    return disagreements


def notes(tag, root=ROOT):
    """Return the part of the changelog that belongs to a tag; empty if there is none."""
    changes = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    version = re.escape(tag.removeprefix("v"))
    section = re.search(
        rf"^## {version}(?![\w.])[^\n]*\n(.*?)(?=^## |\Z)", changes, re.DOTALL | re.MULTILINE
    )
    return section[1].strip() if section else ""


def main(tag):
    """Print the notes of a tag, or what disagrees with it; return the exit code."""
    disagreements = problems(tag)
    for problem in disagreements:
        click.echo(problem, err=True)
    if not disagreements:
        click.echo(notes(tag))
    return 1 if disagreements else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
