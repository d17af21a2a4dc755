"""The table of wrong programs fits the code."""

import ast
from collections import Counter

import pytest
from support.mutants import FOLDER, ROOT, Mutant, mutants

ALL = list(mutants())


@pytest.mark.parametrize("mutant", ALL, ids=lambda one: f"{one.room}: {one.what}")
def test_a_mutant_changes_one_place_of_the_code(mutant: Mutant) -> None:
    ast.parse(mutant.changed())
    for test in (*mutant.first, *mutant.tests):
        path, _, name = test.partition("::")
        assert (ROOT / path).exists()
        if name:
            text = (ROOT / path).read_text(encoding="utf-8")
            assert f"def {name.partition('[')[0]}(" in text


def test_mutants_differ():
    assert len({(one.file, one.old, one.new) for one in ALL}) == len(ALL)


def test_each_room_has_mutants_that_tests_notice():
    noticed = Counter(mutant.room for mutant in ALL if not mutant.survives)
    assert set(noticed) == {path.stem for path in FOLDER.glob("*.toml")}
    assert min(noticed.values()) >= 10
    assert len(ALL) - noticed.total() <= 5
