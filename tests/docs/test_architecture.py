"""Protects the page about the program: it is short, and what it names exists."""

import ast
import re
from graphlib import CycleError, TopologicalSorter

import grimp
import pytest
from support.documents import ROOT, names_in, page

PAGE = page("architecture")

TREES = (ROOT / "src/rbstab", ROOT / "cli/rbstab_cli")

MODULES = [path for tree in TREES for path in sorted(tree.rglob("*.py"))]

ROOMS = sorted({path.parent for path in MODULES if path.stem[:2] != "__"})

LARGEST_ROOM = 16

OF_CONFIGS_AND_SHELLS = {"K_r: [1200, 1200, 1200]", "controller.K_r[0]", "--set", "rbstab --help"}


def is_path(word):
    return any((top / word).exists() for top in (ROOT, ROOT / "src/rbstab"))


def test_what_it_names_exists():
    named = set(re.findall(r"`([^`]+)`", PAGE)) - OF_CONFIGS_AND_SHELLS
    names = frozenset().union(*map(names_in, MODULES))
    assert [word for word in sorted(named) if not is_path(word) and word not in names] == []


def test_it_has_two_thousand_words_at_most():
    assert len(PAGE.split()) <= 2000


def test_a_number_passes_twenty_functions_at_most():
    travels = PAGE.split("## How a number travels")[1].split("\n## ")[0]
    functions = set(re.findall(r"`([a-z_]+)`", travels))
    assert 10 <= len(functions) <= 20


def test_each_floor_has_its_row():
    floors = {path.name for path in (ROOT / "src/rbstab").iterdir() if path.is_dir()}
    floors -= {"__pycache__"}
    assert set(re.findall(r"\| `src/rbstab/(\w+)` \|", PAGE)) == floors


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: room.relative_to(ROOT).as_posix())
def test_no_room_is_crowded(room):
    modules = [path for path in room.glob("*.py") if path.stem[:2] != "__"]
    assert len(modules) <= LARGEST_ROOM


def test_each_file_says_what_it_is():
    files = [*MODULES, *(ROOT / "tests").rglob("*.py")]
    described = {
        path: ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        for path in files
        if path.name != "__init__.py"
    }
    assert [path for path, text in described.items() if len(text.split("\n")[0]) <= 8] == []


def test_no_modules_import_each_other_in_a_circle():
    """Neither when they run, nor for types alone."""
    graph = grimp.build_graph("rbstab", "rbstab_cli", cache_dir=None)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        pytest.fail(f"a circle: {' -> '.join(error.args[1])}")
