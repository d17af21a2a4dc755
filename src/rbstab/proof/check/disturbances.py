"""Check a claim on disturbances: theorem 16.

From the record (`rbstab.proof.disturbed.record`) come numbers, and matrices of Θ as exact
operations. For z = (1, x, u, w), V = z'(V0 + εV1)z and V' = z'(W0 + εW1)z. On each box of a cover
of |θ_i| <= ρ one of these is shown:

    the tilt is above ρ;
    V - ℓ is positive definite in (1, x, u);
    V is positive definite in (x, u), -V' - α(V - ℓ) + Σ β(|w|² - w̄²) in z, and where the tilt is ρ
    also V - ℓ in (1, x, u).

The tilt φ is below ρ where q = cos φ/2 is above cos ρ/2. So for any λ, V - ℓ + λ(q - cos ρ/2) is
V - ℓ where the tilt is ρ; with a large λ it is definite on wide boxes.
A matrix over a box is its tangent plane at the middle and a remainder of second order. The plane is
definite if it is at the corners.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

from flint import arb, arb_mat, fmpq

from rbstab.proof.check.cover import cover, width
from rbstab.proof.check.energy import ANGLES, Energy, rational, read_energy
from rbstab.proof.check.findings import (
    VERSION,
    Box,
    Finding,
    RefusedError,
    TooLongError,
    confirmed,
)
from rbstab.proof.check.matrices import inverse
from rbstab.proof.check.taylor import (
    Ball,
    Series,
    constant,
    derivative,
    leaf,
    summed,
    whole_power,
)

CHECKED_VERSION = 1

DISTURBANCES = "all disturbances"

NARROWEST = 2.0**-11
"""A box that is narrower than this, relative to ρ, and is not settled, refuses the claim."""

STEEP = fmpq(106, 100)
"""λ(1 - cos ρ/2) is so many ℓ: then it is definite at Θ = 0 too."""

SWITCHES = frozenset({"step", "positive"})
"""Operations without derivatives that bound them."""

CORNERS = tuple(product((-1, 1), repeat=3))


def bound_findings(record: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield the findings on a claim: there is one."""
    if record["version"] != CHECKED_VERSION:
        text = f"This checker knows version {CHECKED_VERSION} of such claims alone."
        yield Finding(DISTURBANCES, VERSION, False, text)
        return
    claim = _Claim(record)
    end = math.nextafter(float(claim.tilt), math.inf)
    covered = cover(((-end, end),) * 3, claim.reason, narrowest=NARROWEST * end)
    if covered.open is not None and width(covered.open) > NARROWEST * end:
        raise TooLongError("the check takes too many boxes")
    sizes = ", ".join(str(rational(load["size"])) for load in record["loads"])
    text = f"No disturbance up to w̄ = {sizes} takes the tilt to ρ = {claim.tilt} rad"
    text += " from a start with V < ℓ"
    yield confirmed(DISTURBANCES, "bound", text, {"|θ_i| <= ρ": covered})


_Entry = tuple[Any, Sequence[tuple[Any, int]]]
"""An entry of a matrix: a number, and the factors of operations that are added to it."""

_Plane = tuple[Ball, ...]
"""An entry over a box: its middle, its slopes times the half widths, and its largest error."""


class _Claim:
    """The two matrices of a claim, as sums of operations, and its tilt."""

    def __init__(self, record: Mapping[str, Any]) -> None:
        cross, rate, level, self.tilt = (
            rational(record[name]) for name in ("cross", "rate", "level", "tilt")
        )
        loads = [(rational(load["size"]), rational(load["weight"])) for load in record["loads"]]
        if not (min(rate, level, self.tilt, *map(min, loads)) > 0 and loads):
            raise RefusedError("a number that must be positive is not")
        if not arb(self.tilt) < arb.pi() / 2:
            raise RefusedError("the tilt is not below π/2")
        self.cosine = (arb(self.tilt) / 2).cos()
        V, W = record["values"], record["rates"]
        still, size = len(V[0]), len(V[0]) + 3 * len(loads)
        if [*map(len, (*V, *W))] != [still, still, size, size]:
            raise RefusedError("the matrices have other sizes")
        given = read_energy(record["operations"]).operations
        if any(kind in SWITCHES for kind, *_ in given):
            raise RefusedError("an entry of a matrix may switch")
        if not all(
            type(k) is int and 0 <= k < len(given) for M in (*V, *W) for row in M for k in row
        ):
            raise RefusedError("an entry of a matrix is no operation")
        form = [(fmpq(1), V[0]), (cross, V[1])]
        parts = [(fmpq(-1), W[0]), (-cross, W[1]), *((-rate * c, M) for c, M in form)]
        spent = rate * level - sum((b * w * w for w, b in loads), fmpq(0))
        of_loads = {(still + k, still + k): loads[k // 3][1] for k in range(3 * len(loads))}
        self.above = _rows(form, still, {(0, 0): -level})
        self.falling = _rows(parts, size, {(0, 0): spent, **of_loads})
        scalar, (added, terms) = _append_scalar(given), self.above[0][0]
        self.forms = Energy(given)
        slope = STEEP * level / (1 - self.cosine)
        self.border = [[(added - slope * self.cosine, [*terms, (slope, scalar)])]]

    def reason(self, box: Box) -> str | None:
        """Return why a box is settled; None if it is not known to be."""
        over = [arb(a).union(arb(b)) for a, b in box]
        at = self.forms({k: leaf(k, x.mid()) for k, x in enumerate(over)}, 1)
        all_over = self.forms({k: leaf(k, x) for k, x in enumerate(over)})
        scalar, half = constant(all_over[-1]), [x.rad() for x in over]
        if scalar < self.cosine:
            return "t"
        above = _planes(self.above, at, all_over, half)
        if is_definite(above):
            return "v"
        border = [*_planes(self.border, at, all_over, half), *above[1:]]
        if not (scalar > self.cosine or is_definite(border)):
            return None
        inner = [row[1:] for row in above[1:]]
        if is_definite(inner) and is_definite(_planes(self.falling, at, all_over, half)):
            return "d"
        return None


def _rows(
    parts: Sequence[tuple[Any, Any]], size: int, added: Mapping[tuple[int, int], Any]
) -> list[list[_Entry]]:
    """Return the rows of a sum of matrices with factors and numbers, up to the diagonal."""
    return [
        [
            (added.get((i, j), fmpq(0)), [(c, M[i][j]) for c, M in parts if i < len(M)])
            for j in range(i + 1)
        ]
        for i in range(size)
    ]


def _append_scalar(operations: list[Any]) -> int:
    """Append c1 c2 c3 - s1 s2 s3 of half the angles: the scalar of the quaternion."""

    def put(*operation: Any) -> int:
        operations.append(operation)
        return len(operations) - 1

    half = [put("sum", fmpq(0), ((fmpq(1, 2), put("var", k)),)) for k in ANGLES]
    c, s = ([put(kind, k) for k in half] for kind in ("cos", "sin"))
    c3, s3 = (put("times", put("times", x, y), z) for x, y, z in (c, s))
    return put("sum", fmpq(0), ((fmpq(1), c3), (fmpq(-1), s3)))


def _planes(
    rows: Sequence[Sequence[_Entry]],
    at: Sequence[Series],
    over: Sequence[Series],
    half: Sequence[Ball],
) -> list[list[_Plane]]:
    """Return entries over a box, from all operations at its middle and over it."""
    ways = [arb(0, r) for r in half]
    squares = {(i, j): ways[i] * ways[j] for i, j in product(ANGLES, repeat=2) if i < j}
    squares |= {(i, i): whole_power(way, 2) for i, way in enumerate(ways)}

    def plane(added: Any, terms: Sequence[tuple[Any, int]]) -> _Plane:
        x, y = (summed((arb(c), series[k]) for c, k in terms) for series in (at, over))
        rest = constant(x) + added
        for k, square in squares.items():
            if k in y:
                rest += y[k] * square
        slopes = [derivative(x, k) * r for k, r in enumerate(half)]
        error = sum((slope.rad() for slope in slopes), rest.rad())
        return (rest.mid(), *(slope.mid() for slope in slopes), error)

    return [[plane(*entry) for entry in row] for row in rows]


def is_definite(rows: Sequence[Sequence[_Plane]]) -> bool:
    """Return whether symmetric matrices are positive definite, all over a box.

    Errors R_ij take at most Σ_j R_ij t_i/t_j from the diagonal, for any t > 0: so
    R_ij |x_i x_j| <= ½ R_ij (t_i/t_j x_i² + t_j/t_i x_j²).

    Args:
        rows: Those of the matrix, up to the diagonal.
    """
    n = range(len(rows))
    entries = [[rows[max(i, j)][min(i, j)] for j in n] for i in n]
    near = inverse(arb_mat([[x[0] for x in row] for row in entries]))
    if not all(near[i, i] > 0 for i in n):
        return False
    t = [(1 / near[i, i]).sqrt().mid() for i in n]
    lost = [sum((entries[i][j][4] * t[i] / t[j] for j in n), arb(0)) for i in n]
    for signs in CORNERS:
        corner = [
            [x[0] + sum((s * y for s, y in zip(signs, x[1:4], strict=True)), arb(0)) for x in row]
            for row in entries
        ]
        for i in n:
            corner[i][i] -= lost[i]
        if not _has_positive_pivots(corner):
            return False
    return True


def _has_positive_pivots(M: list[list[Ball]]) -> bool:
    """Return whether a symmetric matrix is shown to be positive definite."""
    # `matrices.negative` needs more bits for matrices of many rows of different sizes.
    n = len(M)
    for k in range(n):
        if not M[k][k] > 0:
            return False
        for i in range(k + 1, n):
            factor = M[i][k] / M[k][k]
            for j in range(k + 1, i + 1):
                M[i][j] -= factor * M[j][k]
    return True
