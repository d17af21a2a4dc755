"""Protects the map of the program: every module is on the architecture page, once, in its room.

A room stays small enough to know by heart.
"""

import importlib.util
import re
from collections import Counter
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]

PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")

LARGEST_ROOM = 16

ROOMS = sorted(
    {
        path.parent.relative_to(ROOT).as_posix()
        for tree in ("src/rbstab", "cli/rbstab_cli")
        for path in (ROOT / tree).rglob("*.py")
        if path.stem[:2] != "__"
    }
)


@pytest.fixture(scope="module")
def tables() -> ModuleType:
    """The program that writes the tables of the page."""
    path = ROOT / "docs" / "architecture_tables.py"
    spec = importlib.util.spec_from_file_location("architecture_tables", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_tables_are_those_of_the_code(tables: ModuleType) -> None:
    assert tables.filled(PAGE) == PAGE, "run `make docs`"


def test_each_room_has_one_table() -> None:
    # src/rbstab itself has only the public interface, in its __init__.py.
    assert Counter(re.findall(r"<!-- modules of (\S+) -->", PAGE)) == Counter(ROOMS)


def test_each_floor_has_its_row() -> None:
    floors = {"/".join(room.split("/")[:3]) for room in ROOMS if room.startswith("src")}
    for floor in floors | {"cli/rbstab_cli"}:
        assert PAGE.count(f"| `{floor}` |") == 1, floor


@pytest.mark.parametrize("room", ROOMS)
def test_no_room_is_crowded(room: str) -> None:
    modules = [path for path in (ROOT / room).glob("*.py") if path.stem[:2] != "__"]
    assert len(modules) <= LARGEST_ROOM


def test_each_test_file_says_what_it_protects(tables: ModuleType) -> None:
    silent = [path for path in (ROOT / "tests").rglob("*.py") if len(tables.described(path)) < 20]
    assert silent == []


@pytest.mark.parametrize("room", ROOMS)
def test_each_module_says_what_it_is(room: str, tables: ModuleType) -> None:
    for module in (ROOT / room).glob("*.py"):
        assert len(tables.described(module)) > 8, module
