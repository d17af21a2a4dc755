"""An energy as a function of z: convex, but for springs of a body that is not held (theorem 12).

U is a positive definite quadratic form of z, plus functions that are convex in z by the rules: sums
with positive factors, even powers of what is affine in z, powers of what is convex and not
negative, exponentials of what is convex, lengths of vectors that are affine in z.

Terms -w ℓ of U with a length ℓ = |z + r(Θ)| are its springs. With S >= λI for the form ½ z'Sz and
P = Σ w_j, ∂U/∂z = 0 implies |z| <= ρ = (P + |∂N(Θ, 0)|)/λ, where N is what is convex. For these z,
ℓ_j >= |r_j| - ρ, and U is convex if λ > Σ w_j/(|r_j| - ρ).
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from flint import arb

from rbstab.proof.check.energy import About, Energy
from rbstab.proof.check.matrices import negative
from rbstab.proof.check.taylor import ORDER, Ball, Series, constant, derivative, leaf, summed

CONSTANT, AFFINE, CONVEX, OTHER = 0, 1, 2, 3


class Line(NamedTuple):
    """A spring: w, the operation that is its length, and those that are its z_i + r_i."""

    weight: Ball
    length: int
    ends: tuple[int, ...]


class Parts(NamedTuple):
    """The terms of an energy.

    Attributes:
        stiffness: λ, or 0 if S is not definite.
        lines: The springs.
        others: The other terms that depend on z, each with its factor.
    """

    stiffness: Ball
    lines: tuple[Line, ...]
    others: tuple[tuple[Any, int], ...]


@lru_cache(maxsize=2)
def parts_of(U: Energy) -> Parts:
    """Take an energy with variables z apart."""
    S, left = U.quadratic(U.free)
    lines, others = list[Line](), list[tuple[Any, int]]()
    for c, k in left:
        ends = _ends(U, k)
        if c < 0 and ends is not None:
            lines.append(Line(-arb(c), k, ends))
        elif not U.depends[k].isdisjoint(U.free):
            others.append((c, k))
    return Parts(_least_eigenvalue(S), tuple(lines), tuple(others))


def _ends(U: Energy, k: int) -> tuple[int, ...] | None:
    """Return the operations z_i + r_i(Θ) of which one is the length; None if it is no length."""
    squares = list[tuple[Any, int]]()
    match U.operations[k]:
        case "sqrt", j if U.operations[j][:2] == ("sum", 0):
            squares = _squares(U, j)
    ends = {_moved(U, x): x for c, x in squares if c == 1}
    each_once = len(squares) == len(U.free) and set(ends) == set(U.free)
    return tuple(ends[i] for i in U.free) if each_once else None


def _squares(U: Energy, k: int) -> list[tuple[Any, int]]:
    """Return each factor and x of an operation c + Σ c_j x_j²; none if it has another form."""
    match U.operations[k]:
        case "sum", _, terms if all(U.operations[j][:2] == ("pow", 2) for _, j in terms):
            return [(c, U.operations[j][2]) for c, j in terms]
    return []


def _moved(U: Energy, k: int) -> int | None:
    """Return the number i of an operation z_i + r_i(Θ); None if it is none."""
    kind, *rest = U.operations[k]
    if kind == "var":
        return rest[0] if rest[0] in U.free else None
    free_terms = [(c, j) for c, j in rest[1] if U.depends[j] & set(U.free)] if kind == "sum" else []
    if len(free_terms) != 1 or free_terms[0][0] != 1:
        return None
    inner = U.operations[free_terms[0][1]]
    return inner[1] if inner[0] == "var" else None


def _least_eigenvalue(S: Any) -> Ball:
    """Return a lower bound of the least eigenvalue of a matrix; 0 if it is not definite."""
    if negative(S) != 0:
        return arb(0)
    least, n = S.inv(), range(S.nrows())
    # The largest eigenvalue of S⁻¹ is at most its largest sum of a row.
    return 1 / max((sum((abs(least[i, j]) for j in n), arb(0)).upper() for i in n), key=float)


def is_single(U: Energy, leaves: Mapping[int, Series], over: Sequence[Series]) -> bool:
    """Return whether U has one stationary point z for all Θ of a box.

    Args:
        U: The energy.
        leaves: The series of its variables over the box, z in balls that contain such a point.
        over: The series of all operations over the box.
    """
    stiffness, lines, others = parts_of(U)
    if not lines:
        return True
    pull = arb(0)
    if others:
        series = U({**leaves, **{k: leaf(k, arb(0)) for k in U.free}}, 1)
        slopes = summed((arb(c), series[j]) for c, j in others)
        pull = _length([derivative(slopes, k) for k in U.free])
    # |r_j| is at least |z + r_j| - |z|.
    away = (sum((line.weight for line in lines), arb(0)) + pull) / stiffness
    away += _length([constant(leaves[k]) for k in U.free])
    rooms = [constant(over[line.length]) - away for line in lines]
    softer = [line.weight / room for line, room in zip(lines, rooms, strict=True)]
    return all(room > 0 for room in rooms) and bool(sum(softer, arb(0)) < stiffness)


def _length(x: Sequence[Ball]) -> Ball:
    return sum((a * a for a in x), arb(0)).abs_upper().sqrt()


class WithoutLength(Energy):
    """The energy where a spring has no length, z = -r(Θ): a function of Θ.

    Args:
        U: The energy.
        line: The spring.
    """

    def __init__(self, U: Energy, line: Line) -> None:
        super().__init__(
            U.with_terms([term for term in U.terms if term[1] != line.length]).operations
        )
        self._places = dict(zip(U.free, line.ends, strict=True))

    def __call__(
        self, leaves: Mapping[int, Series], order: int = ORDER, about: About = None
    ) -> list[Series]:
        """Return the series of all operations; r is z + r where z is zero.

        Args:
            leaves: The series of the variables, as for `Energy`.
            order: The highest order.
            about: As for `Energy`.
        """
        zero: dict[int, Series] = {z: {} for z in self._places}
        ends = super().__call__({**leaves, **zero}, order)
        moved = {z: summed([(arb(-1), ends[k])]) for z, k in self._places.items()}
        return super().__call__({**leaves, **moved}, order, about)


def why_not_convex(U: Energy) -> str | None:
    """Return what is not shown about U as a function of z; None if all but springs is convex."""
    shapes, parts = _shapes(U), parts_of(U)
    for c, j in parts.others:
        if not (shapes[j] <= AFFINE or (shapes[j] == CONVEX and c > 0)):
            return f"Operation {j + 1} is not shown to be convex in z"
    return None if parts.stiffness > 0 else "The quadratic form of z is not positive definite"


def _shapes(U: Energy) -> list[int]:
    """Return for each operation how it depends on z."""
    shapes, positive, z = list[int](), list[bool](), frozenset(U.free)
    for k, operation in enumerate(U.operations):
        shape, not_negative = OTHER, False
        match operation:
            case "var", _:
                shape = AFFINE
            case "sum", c0, terms:
                of_terms = [shapes[j] if shapes[j] < CONVEX or c > 0 else OTHER for c, j in terms]
                shape = max(of_terms, default=CONSTANT)
                not_negative = c0 >= 0 and all(c > 0 and positive[j] for c, j in terms)
            case "times", i, j if {shapes[i], shapes[j]} == {CONSTANT, AFFINE}:
                shape = AFFINE
            case "pow", n, j if n > 0:
                not_negative = n % 2 == 0 or positive[j]
                even = shapes[j] == AFFINE and n % 2 == 0
                shape = CONVEX if even or (shapes[j] == CONVEX and positive[j]) else OTHER
            case "sqrt", j:  # the length of a vector that is affine in z
                squares = _squares(U, j)
                is_length = all(c > 0 and shapes[x] <= AFFINE for c, x in squares)
                is_length = is_length and bool(squares) and U.operations[j][1] >= 0
                shape, not_negative = CONVEX if is_length else OTHER, True
            case "exp", j:
                shape, not_negative = CONVEX if shapes[j] < OTHER else OTHER, True
        shapes.append(shape if U.depends[k] & z else CONSTANT)
        positive.append(not_negative)
    return shapes
