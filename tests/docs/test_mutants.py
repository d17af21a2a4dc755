"""The table of wrong programs fits the code."""

import ast
from collections import Counter

import pytest
from support.mutants import FOLDER, ROOT, mutants

ALL = list(mutants())


ROOMS = sorted({mutant.room for mutant in ALL})


@pytest.mark.parametrize("room", ROOMS)
def test_each_mutant_of_a_room_changes_one_place_of_the_code(room):
    for mutant in (candidate for candidate in ALL if candidate.room == room):
        assert fits(mutant), mutant.what


def fits(mutant):
    """Return whether a mutant is a program, and its tests are there."""
    ast.parse(mutant.changed())
    for test in (*mutant.first, *mutant.tests):
        path, _, name = test.partition("::")
        text = (ROOT / path).read_text(encoding="utf-8") if (ROOT / path).is_file() else ""
        if not (ROOT / path).exists() or (name and f"def {name.partition('[')[0]}(" not in text):
            return False
    return True


def test_mutants_differ():
    assert len({(candidate.file, candidate.old, candidate.new) for candidate in ALL}) == len(ALL)


def test_each_room_has_mutants_that_tests_notice():
    noticed = Counter(mutant.room for mutant in ALL if not mutant.survives)
    assert set(noticed) == {path.stem for path in FOLDER.glob("*.toml")}
    assert min(noticed.values()) >= 10
    assert len(ALL) - noticed.total() <= 5
