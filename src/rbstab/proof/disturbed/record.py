"""The stored form of a claim on disturbances: its numbers, and V and V' as exact operations.

    {"version": 1, "tilt": "1/2",
     "loads": [{"kind": "couple", "point": [0, 0, 0], "size": "20", "weight": "0.142"}],
     "cross": "5.76", "rate": "8.51", "level": "6.6", "rest": [...],
     "operations": [...], "values": [V0, V1], "rates": [W0, W1]}

V is z'(V0 + εV1)z with z = (1, x, u) as in `forms`, and V' is z'(W0 + εW1)z with (1, x, u, w). A
matrix is the list of its rows up to the diagonal, and an
entry is the number of an operation, as in `rbstab.proof.record`. Numbers are exact, but for `rest`.
Where nothing is proved, there are `version`, `tilt`, and loads without a weight.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rbstab.proof.disturbed.forms import Forms, Load, Rows
from rbstab.proof.disturbed.invariant import Claim
from rbstab.proof.exact.expr import Expr
from rbstab.proof.record import Record, WrongRecordError, expressions_of, shared_operations

VERSION = 1


class Stated(NamedTuple):
    """Bounds on loads, N m or N, and one on the tilt, rad."""

    given: Mapping[Load, Fraction]
    tilt: Fraction

    @property
    def record(self) -> Record:
        """The same as plain data."""
        loads = [
            {"kind": load.kind, "point": [*load.point], "size": str(size)}
            for load, size in self.given.items()
        ]
        return {"version": VERSION, "tilt": str(self.tilt), "loads": loads}


def claim_record(stated: Stated, forms: Forms, claim: Claim) -> Record:
    """Return a claim as plain data.

    Args:
        stated: What it is about.
        forms: V and V'.
        claim: Its numbers.
    """
    operations, numbers = shared_operations(list(_entries(forms)))
    entry, record = iter(numbers), stated.record

    def rows(size: int) -> list[list[int]]:
        return [[next(entry) for _ in range(i + 1)] for i in range(size)]

    loads = zip(record["loads"], claim.weights, strict=True)
    return record | {
        "loads": [load | {"weight": str(weight)} for load, weight in loads],
        **{name: str(getattr(claim, name)) for name in ("cross", "rate", "level")},
        "rest": forms.rest.tolist(),
        "values": [rows(forms.still) for _ in forms.values],
        "rates": [rows(len(M)) for M in forms.rates],
        "operations": operations,
    }


@contextmanager
def reading() -> Iterator[None]:
    """Make errors of reading a claim to one of a wrong record."""
    try:
        yield
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise WrongRecordError(f"the claim cannot be read: {error}") from error


def read_stated(record: Mapping[str, Any]) -> Stated:
    """Return what a claim is about, also if it is not proved.

    Raises:
        WrongRecordError: It is none of this version.
    """
    if record.get("version") != VERSION:
        raise WrongRecordError("the claim has another version")
    with reading():
        given = {
            Load(entry["kind"], tuple(map(float, entry["point"]))): Fraction(entry["size"])
            for entry in record["loads"]
        }
        kinds = [load.kind for load in given]
        if len(kinds) < len(record["loads"]) or not {"couple", "force"}.issuperset(kinds):
            raise ValueError("a load is there twice, or is of no kind")
        return Stated(given, Fraction(record["tilt"]))


def read_claim(record: Mapping[str, Any]) -> tuple[Forms, Claim]:
    """Return V, without w, and V', and the numbers of a claim.

    Raises:
        WrongRecordError: It is none of this version, or nothing is proved.
    """
    given, tilt = read_stated(record)
    with reading():
        expressions = expressions_of(record["operations"])
        values, rates = (
            [_rows(M, expressions) for M in record[key]] for key in ("values", "rates")
        )
        still, rest = len(values[0]), np.array(record["rest"])
        forms = Forms((values[0], values[1]), (rates[0], rates[1]), still, rest)
        weights = tuple(Fraction(load["weight"]) for load in record["loads"])
        cross, rate, level = (Fraction(record[name]) for name in ("cross", "rate", "level"))
        if not min(float(rate), float(level)) > 0:
            raise ValueError("a number that must be positive is not")
        return forms, Claim(tilt, tuple(given.values()), weights, cross, rate, level)


def _entries(forms: Forms) -> Iterator[Expr]:
    """Yield the entries of all matrices, row by row up to the diagonal."""
    for M in (*(M[: forms.still] for M in forms.values), *forms.rates):
        for i, row in enumerate(M):
            yield from row[: i + 1]


def _rows(numbers: Sequence[Sequence[int]], expressions: Sequence[Expr]) -> Rows:
    """Return a symmetric matrix from the numbers of its entries."""
    n = range(len(numbers))
    return [[expressions[numbers[max(i, j)][min(i, j)]] for j in n] for i in n]


def difference_from(record: Mapping[str, Any], forms: Forms) -> str | None:
    """Return in which way a stored claim is not about some V and V'; None if it is.

    Args:
        record: The claim.
        forms: V and V' that were made from a config.
    """
    try:
        stored, _ = read_claim(record)
    except WrongRecordError as error:
        return str(error)
    if stored.rest.tolist() != forms.rest.tolist():
        return "their states at rest are different"
    same = [*_entries(stored)] == [*_entries(forms)]
    return None if same else "V, or V', is different"
