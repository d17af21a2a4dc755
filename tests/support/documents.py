"""Pages of the documentation in parts: sections, tables, blocks and numbers; its scripts."""

import ast
import re
import sys
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
FIGURES = DOCS / "figures"

NUMBER = re.compile(r"-?\d+\.?\d*(?:e[+-]?\d+)?")


def page(name):
    """Return the text of a page."""
    return (DOCS / f"{name}.md").read_text(encoding="utf-8")


def section(text, heading, level="##"):
    """Return the text below a heading."""
    return text.split(f"\n{level} {heading}\n")[1].split(f"\n{level} ")[0]


def tables(text):
    """Return the tables, each a list of rows of cells: the head, then those below its line."""
    parsed = []
    for block in re.findall(r"(?:^\|.*\|\n)+", text, flags=re.MULTILINE):
        split = (re.split(r"(?<!\\)\|", line)[1:-1] for line in block.splitlines())
        head, _, *rows = [[cell.strip() for cell in line] for line in split]
        parsed.append([head, *rows])
    return parsed


def blocks_of(text, language):
    """Return the texts of the fenced blocks in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)


@cache
def names_in(path):
    """Return the names of the functions, classes, their members and the constants of a module."""
    tree, names = ast.parse(path.read_text(encoding="utf-8")), set()
    classes = [node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
    for owner, node in (("", tree), *((f"{member.name}.", member) for member in classes)):
        for member in node.body:
            if isinstance(member, ast.FunctionDef | ast.ClassDef):
                names |= {member.name, owner + member.name}
            elif isinstance(member, ast.Assign | ast.AnnAssign):
                targets = member.targets if isinstance(member, ast.Assign) else [member.target]
                names |= {owner + target.id for target in targets if isinstance(target, ast.Name)}
    return frozenset(names)


def numbers(text):
    """Return the numbers in a text."""
    return [float(number) for number in NUMBER.findall(text)]


def script(path):
    """Return a script of the documentation as a module."""
    spec = spec_from_file_location(f"docs_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def assert_same_drawing(path, made):
    """Assert that a stored SVG is the one that its script makes, but for round-off."""
    stored, number = path.read_text(encoding="utf-8"), re.compile(r"-?\d+\.\d+")
    assert number.sub("#", stored) == number.sub("#", made), "run `make figures`"
    stored_numbers, made_numbers = (
        [float(n) for n in number.findall(text)] for text in (stored, made)
    )
    assert stored_numbers == pytest.approx(made_numbers, abs=0.2)
