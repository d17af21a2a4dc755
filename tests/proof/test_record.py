"""Records are read as what was written, and wrong ones are refused."""

import json
from fractions import Fraction

import pytest

from rbstab.proof.exact.expr import Expr, variable
from rbstab.proof.model import Energy
from rbstab.proof.record import (
    WrongRecordError,
    difference_from,
    energy_record,
    expression_of,
    operations_of,
    read_energy,
)

X, Y, Z = variable(0), variable(1), variable(2)

EXPRESSIONS = [
    Expr({}),
    X**2 * Y.sin() ** 3 - Fraction(2, 7) * Z.cos() ** -2,
    ((X.cos() + 2).sqrt() - 1) ** 3 * (X - Y).step(3),
    (2 * (1 + X * Y).sqrt() + 1) ** -1,
    (2 + (Y + 3).log()).atan() * (3 + X.sin()).sqrt(),
]


@pytest.mark.parametrize("e", EXPRESSIONS, ids=repr)
def test_expressions_are_read_as_written(e):
    operations = json.loads(json.dumps(operations_of(e)))
    assert expression_of(operations) == e


@pytest.mark.parametrize(
    "operations",
    [
        [],
        [["tan", 0]],
        [["var", 0], ["times", 0, -1]],
        [["var", 0], ["sum", "0", "1"]],
        [["sum", "a half"]],
        [["sum", "0"], ["pow", -1, 0]],
    ],
    ids=str,
)
def test_what_is_no_expression_is_refused(operations):
    with pytest.raises(WrongRecordError):
        expression_of(operations)


def test_each_part_of_an_energy_is_compared():
    energy = Energy(X**2 + Y.cos() * 3, (3,), stop=Fraction(9, 10), closed=frozenset({1}))
    record = json.loads(json.dumps(energy_record(energy)))
    assert difference_from(record, energy) is None
    assert read_energy(record).U == energy.U
    others = [
        Energy(X**2 + Y.cos() * 2, (3,), stop=Fraction(9, 10), closed=frozenset({1})),
        Energy(energy.U, (), stop=Fraction(9, 10), closed=frozenset({1})),
        Energy(energy.U, (3,), stop=Fraction(91, 100), closed=frozenset({1})),
        Energy(energy.U, (3,), stop=Fraction(9, 10)),
    ]
    assert all(difference_from(record, other) for other in others)
    record["operations"][-1][2] = "-1"
    with pytest.raises(WrongRecordError, match="digest"):
        read_energy(record)
