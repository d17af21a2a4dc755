"""Springs of a body that is not held: U is not convex in its position z (theorem 12).

Terms -w ℓ of U with a length ℓ = |z + r(Θ)| are its springs; all else is ½ z'Sz and functions that
are convex in z. With S >= λI and P = Σ w_j, ∂U/∂z = 0 implies |z| <= ρ = (P + |∂N(Θ, 0)|)/λ, where
N is what is convex. For these z, ℓ_j >= |r_j| - ρ, and U is convex if λ > Σ w_j/(|r_j| - ρ).
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from flint import arb, arb_mat

from rbstab.proof.check.bounds import minors
from rbstab.proof.check.energy import Energy, variables_of
from rbstab.proof.check.taylor import ORDER, Ball, Series

ANGLES = 3

HALVINGS = 40


class Line(NamedTuple):
    """A spring: w, N, the operation that is its length, and those that are its z_i + r_i."""

    weight: Ball
    length: int
    ends: tuple[int, ...]


class Springs(NamedTuple):
    """The terms of an energy.

    Attributes:
        S: The matrix of ½ z'Sz.
        stiffness: λ, or 0 if S is not definite.
        lines: The springs.
        others: The other terms that depend on z, each with its factor.
    """

    S: list[list[Ball]]
    stiffness: Ball
    lines: tuple[Line, ...]
    others: tuple[tuple[Ball, int], ...]


def springs_of(U: Energy) -> Springs:
    """Take an energy apart; the last operation is a sum."""
    n, z = len(U.free), frozenset(U.free)
    S, lines, others = [[arb(0)] * n for _ in range(n)], list[Line](), list[tuple[Ball, int]]()
    for c, k in U.operations[-1][2]:
        factors = variables_of(U, k)
        ends = ends_of(U, k) if c < 0 else None
        if factors is not None and len(factors) == 2 and min(factors) >= ANGLES:
            i, j = (f - ANGLES for f in factors)
            S[i][j] += arb(c)
            S[j][i] += arb(c)
        elif ends is not None:
            lines.append(Line(-arb(c), k, ends))
        elif U.depends[k] & z:
            others.append((c, k))
    return Springs(S, _least_eigenvalue(S), tuple(lines), tuple(others))


def ends_of(U: Energy, k: int) -> tuple[int, ...] | None:
    """Return the operations z_i + r_i(Θ) of which one is the length; None if it is no length."""
    if U.operations[k][0] != "sqrt":
        return None
    kind, *rest = U.operations[U.operations[k][1]]
    if kind != "sum" or rest[0] != 0 or len(rest[1]) != len(U.free):
        return None
    found = dict[int, int]()
    for c, j in rest[1]:
        square = U.operations[j]
        number = _moved(U, square[2]) if c == 1 and square[:2] == ("pow", 2) else None
        if number is None:
            return None
        found[number] = square[2]
    return tuple(found[i] for i in U.free) if set(found) == set(U.free) else None


def _moved(U: Energy, k: int) -> int | None:
    """Return the number i of an operation z_i + r_i(Θ); None if it is none."""
    kind, *rest = U.operations[k]
    if kind == "var":
        return rest[0] if rest[0] in U.free else None
    mine = [(c, j) for c, j in rest[1] if U.depends[j] & set(U.free)] if kind == "sum" else []
    if len(mine) != 1 or mine[0][0] != 1 or U.operations[mine[0][1]][0] != "var":
        return None
    return U.operations[mine[0][1]][1]


def _least_eigenvalue(S: Sequence[Sequence[Ball]]) -> Ball:
    """Return a lower bound of the least eigenvalue of a matrix; 0 if it is not definite."""
    if not S:
        return arb(0)
    low, high = arb(0), min((row[i].lower() for i, row in enumerate(S)), key=float)
    for _ in range(HALVINGS):
        middle = ((low + high) / 2).mid()
        moved = [[x - middle * int(i == j) for j, x in enumerate(row)] for i, row in enumerate(S)]
        definite = all(minor > 0 for minor in minors(arb_mat(moved)))
        low, high = (middle, high) if definite else (low, middle)
    return low


def is_single(
    U: Energy, angles: Mapping[int, Series], over: Sequence[Series], z: Sequence[Ball]
) -> bool:
    """Return whether U has one stationary point z for all Θ of a box.

    Args:
        U: The energy.
        angles: The series of Θ over the box.
        over: The series of all operations over the box, for some z.
        z: Balls that contain these z.
    """
    springs = U.springs
    if not springs.lines:
        return True
    pull = sum((line.weight for line in springs.lines), arb(0)) + _pull(U, springs, angles)
    # |r_j| is at least |z + r_j| - |z|.
    away = pull / springs.stiffness + sum((x * x for x in z), arb(0)).abs_upper().sqrt()
    softer = arb(0)
    for line in springs.lines:
        shortest = over[line.length].get(0, arb(0)) - away
        if not shortest > 0:
            return False
        softer += line.weight / shortest
    return bool(softer < springs.stiffness)


def _pull(U: Energy, springs: Springs, angles: Mapping[int, Series]) -> Ball:
    """Return |∂N/∂z| at z = 0 over a box."""
    if not springs.others:
        return arb(0)
    leaves = dict(angles)
    leaves |= {k: {U.rows.first[ANGLES + i]: arb(1)} for i, k in enumerate(U.free)}
    series = U.all_series(leaves, 2)
    total = arb(0)
    for i in range(len(U.free)):
        row = U.rows.first[ANGLES + i]
        slope = sum((arb(c) * series[k].get(row, arb(0)) for c, k in springs.others), arb(0))
        total += slope * slope
    return total.abs_upper().sqrt()


class Collapsed(Energy):
    """The energy where a spring has no length, z = -r(Θ): a function of Θ."""

    def __init__(self, U: Energy, line: Line) -> None:
        kind, c0, terms = U.operations[-1]
        left = tuple((c, k) for c, k in terms if k != line.length)
        self.operations = [*U.operations[:-1], (kind, c0, left)]
        self.variables, self.n = U.variables[:ANGLES], ANGLES
        self.places = dict(zip(U.free, line.ends, strict=True))
        self._prepare()

    def all_series(
        self,
        leaves: Mapping[int, Series],
        order: int = ORDER,
        about: tuple[Sequence[Series], Sequence[Ball]] | None = None,
    ) -> list[Series]:
        """Return the series of all operations, for those of Θ."""
        r = super().all_series({**leaves, **{k: {} for k in self.places}}, order)
        z = {k: {row: -x for row, x in r[end].items()} for k, end in self.places.items()}
        return super().all_series({**leaves, **z}, order, about)
