"""The table of wrong programs fits the code."""

import ast

import pytest
from support.mutants import ROOT, Mutant, mutants

ALL = list(mutants())


@pytest.mark.parametrize("mutant", ALL, ids=lambda one: f"{one.room}: {one.what}")
def test_a_mutant_changes_one_place_of_the_code(mutant: Mutant) -> None:
    ast.parse(mutant.changed())
    for path in (*mutant.first, *mutant.tests):
        assert (ROOT / path.partition("::")[0]).exists()


def test_mutants_differ():
    assert len({(one.file, one.old, one.new) for one in ALL}) == len(ALL)
