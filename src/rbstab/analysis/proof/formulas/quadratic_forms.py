"""Quadratic forms Σ m_ij x_i x_j in exact numbers."""

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import TypeVar

Form = Mapping[tuple[int, int], Fraction]
"""The entries m_ij of a quadratic form, with m_ij = m_ji stored once."""

_Key = TypeVar("_Key")


def is_semidefinite(form: Form) -> bool:
    """Return whether a quadratic form is never negative, by exact elimination."""
    return all(pivot > 0 or (pivot == 0 and not any(row)) for pivot, *row in _pivots(form))


def _pivots(form: Form) -> Iterator[list[Fraction]]:
    """Yield the rows of the elimination of a form, each from its pivot on; zero ones are kept."""
    places = sorted({index for pair in form for index in pair})
    rows = [[form.get((i, j), form.get((j, i), Fraction(0))) for j in places] for i in places]
    while rows:
        pivot, *row = rows[0]
        yield rows[0]
        rows = [
            # Most forms have many zeros.
            [entry - row[i] * row[j] / pivot if row[j] else entry for j, entry in enumerate(rest)]
            if row[i] and pivot
            else rest
            for i, (_, *rest) in enumerate(rows[1:])
        ]


def added(one: Mapping[_Key, Fraction], other: Mapping[_Key, Fraction]) -> dict[_Key, Fraction]:
    """Return a sum, without entries that are zero."""
    longer, shorter = (one, other) if len(one) > len(other) else (other, one)
    found = dict(longer)
    for key, value in shorter.items():
        found[key] = found.get(key, Fraction(0)) + value
        if not found[key]:
            del found[key]
    return found


def scaled(one: Mapping[_Key, Fraction], factor: Fraction | int) -> dict[_Key, Fraction]:
    """Return a multiple."""
    return {key: factor * value for key, value in one.items()}
