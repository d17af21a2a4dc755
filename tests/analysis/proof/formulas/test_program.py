"""Protects programs: only what a result needs, and nothing that is no program."""

import pytest
from support.formulas import FORMULAS, recorded

from rbstab.analysis.proof.formulas.program import check, computed
from rbstab.mechanics import numbers


def test_only_what_the_result_needs():
    program = recorded(lambda T: [numbers.exp_of(T[0]), T[1] * T[1] - 2.0][1])
    kinds = [operation[0] for operation in program.operations]
    assert kinds == ["theta", "*", "constant", "-"]
    assert program.operations[0] == ("theta", 1)


@pytest.mark.parametrize("name", FORMULAS)
def test_indices_follow_the_operations(name):
    program = recorded(FORMULAS[name])
    check(program.operations)
    count = len(computed(program, lambda leaf: leaf, lambda *operation: operation))
    assert count == len(program.operations)


@pytest.mark.parametrize(
    "operations",
    [
        [],
        [("theta", 3)],
        [("theta", 1.0)],
        [("theta", True)],
        [("constant", 2)],
        [("constant", float("inf"))],
        [("theta", 0), ("sin", 1)],
        [("theta", 0), ("sin", -1)],
        [("theta", 0), ("sin", 0, 0)],
        [("theta", 0), ("+", 0)],
        [("theta", 0), ("abs", 0)],
        [("theta", 0), ("**", 0, 0.5)],
        [("theta", 0), ("**", 0)],
        [("theta", 0), ("omega", 0)],
        [("theta", 0)] * 5001,
    ],
)
def test_what_is_no_program_is_refused(operations):
    with pytest.raises(ValueError, match="formula"):
        check(operations)
