"""An energy and its derivatives over a box: theorem 1 of docs/proofs.md, in balls.

With the middle m of a box, δ = Θ - m, and second derivatives H over all of it,

    ∇U = ∇U(m) + Hδ        U = U(m) + ∇U(m)'δ + ½ δ'Hδ.

Where a force may jump in the box, U is L(Θ, λ), with a variable λ in [0, 1] in place of the step.

Variables z beyond the box are chosen so that U is least. With z = ẑ + Cδ + ζ, where ẑ is near the
minimiser at the middle m, and C near its derivative, this least energy V has

    ∇V = U_δ        ∇²V = U_δδ - U_δζ U_ζζ⁻¹ U_ζδ        where U_ζ = 0.

Krawczyk's test for U_ζ = 0 shows that a stationary point has ζ in a box Z for all Θ of the box. By
`convex` there is no other, and it is the minimiser.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

from flint import arb, arb_mat

from rbstab.proof.check.convex import is_single
from rbstab.proof.check.cover import width
from rbstab.proof.check.energy import Energy, share_of
from rbstab.proof.check.findings import Box
from rbstab.proof.check.matrices import Matrix, column, inverse, negative, part, residual
from rbstab.proof.check.taylor import (
    ORDER,
    UNKNOWN,
    Ball,
    Series,
    constant,
    derivative,
    leaf,
    narrower,
    unknown,
)

STEPS = 40
"""The most steps of Newton's method for ẑ."""

NEAR = 1e-6
"""The last step of this method, as a share of the width of the box."""

TINY = 1e-30

ROUNDING = 1e-12
"""λ: more than a double is rounded."""


class Face(NamedTuple):
    """A face of a range: its name, its axis, its side, and its exact place there."""

    name: str
    axis: int
    side: int
    place: Ball

    def meets(self, box: Box) -> bool:
        """Return whether a part of the face may be in a box."""
        low, high = map(arb, box[self.axis])
        return not (self.place < low or self.place > high)


class _Unknown(Series):
    """A series without bounds."""

    def get(self, *_: Any) -> Ball:
        return UNKNOWN


class Bounds:
    """Bounds of an energy over a box.

    Args:
        U: The energy.
        box: The box, of Θ; over all other variables U is least.
        face: A face: then the box is flat there, at its exact place.
        share: The range of λ.

    Attributes:
        axes: The angles along which the box is not flat.
        jumps: The numbers of the variables λ.
        along: All angles, and `jumps`.
        value: U(m).
        gradient: ∇U(m), by `along`.
        H: ∇²U over the box.
    """

    def __init__(
        self,
        U: Energy,
        box: Box,
        face: Face | None = None,
        share: tuple[float, float] = (0.0, 1.0),
    ) -> None:
        self.U, self.box, self.face = U, box, face
        self.middle, self.half, self.steps = (dict[int, Ball]() for _ in range(3))
        for i, ends in enumerate(box):
            self._put(i, ends)
        if face is not None:
            self.middle[face.axis], self.steps[face.axis] = face.place, arb(0)
        self.axes = [i for i in range(len(box)) if face is None or i != face.axis]
        self.jumps = self._undecided()
        for k in self.jumps:
            self._put(k, share)
        self.along = list(self.steps)
        self.step = column(list(self.steps.values()))
        if not U.free:
            self._evaluate_at(1)
            self._evaluate_over({})
        elif not self._encloses_minimiser():
            unbounded: Series = _Unknown()
            self._at = self._over = unbounded
            self._all_at = self._all_over = [unbounded] * len(U.operations)
        self._reduce()

    def _put(self, i: int, ends: tuple[float, float]) -> None:
        """Set the middle of a variable, exactly, and a ball about 0 that reaches its ends."""
        a, b = map(arb, ends)
        self.middle[i], self.half[i] = (a + b) / 2, (b - a) / 2
        self.steps[i] = arb(0, self.half[i])

    def _undecided(self) -> list[int]:
        """Return a variable λ for each step that jumps, and may do so in the box."""
        if not self.U.jumps:
            return []
        leaves = {i: leaf(i, self.middle[i] + d) for i, d in self.steps.items()}
        values = self.U(leaves | unknown(self.U.free), 0)
        arguments = {k: constant(values[k]) for k in self.U.jumps}
        return [share_of(k) for k, h in arguments.items() if not (h > 0 or h <= 0)]

    # -- where the minimiser is -------------------------------------------------------------------

    def _leaves(self, way: Mapping[int, Ball]) -> dict[int, Series]:
        """Return the series of all variables in δ and ζ; a way that is not given is 0."""
        zero = arb(0)
        leaves = {i: leaf(i, m + way.get(i, zero)) for i, m in self.middle.items()}
        for z in self.U.free:
            C = self._C.get(z, {})
            value = self._zhat[z] + sum((c * way.get(i, zero) for i, c in C.items()), zero)
            leaves[z] = leaf(z, value + way.get(z, zero)) | {(i,): c for i, c in C.items()}
        return leaves

    def _evaluate_at(self, order: int) -> None:
        """Evaluate U at the middle."""
        self._all_at = self.U(self._leaves({}), order)
        self._at = self._all_at[-1]

    def _evaluate_over(self, Z: Mapping[int, Ball]) -> None:
        """Evaluate U over the box, with ζ in Z."""
        way = {**self.steps, **Z}
        self._leaves_over = self._leaves(way)
        self._all_over = self.U(self._leaves_over, about=(self._all_at, way))
        self._over = self._all_over[-1]

    def _follow(self) -> Matrix | None:
        """Find ẑ and C by Newton's method, from where the last box ended; return U_ζζ⁻¹ there."""
        free, near = self.U.free, NEAR * width(self.box) + TINY
        self._C = dict[int, dict[int, Ball]]()
        self._zhat = self.U.last or dict.fromkeys(free, arb(0))
        self.U.last = {}
        for _ in range(STEPS):
            self._evaluate_at(ORDER)
            Y = inverse(second(self._at, free, free))
            step = (Y * first(self._at, free)).mid().entries()
            self._zhat = {z: (self._zhat[z] - s).mid() for z, s in zip(free, step, strict=True)}
            if all(abs(s) < near for s in step):
                C = (-Y * second(self._at, free, self.along)).mid()
                for i, z in enumerate(free):
                    self._C[z] = {k: C[i, j] for j, k in enumerate(self.along) if C[i, j] != 0}
                self.U.last = self._zhat
                self._evaluate_at(1)
                return Y
        return None

    def _encloses_minimiser(self) -> bool:
        """Evaluate U over the box, and return whether Z contains ζ for all Θ (Krawczyk's test)."""
        free, Y = self.U.free, self._follow()
        if Y is None:
            return False
        self._evaluate_over(dict.fromkeys(free, arb(0)))
        drift = Y * (first(self._at, free) + second(self._over, free, self.along) * self.step)
        Z = [arb(0, 2 * x.abs_upper() + TINY) for x in drift.entries()]
        self._evaluate_over(dict(zip(free, Z, strict=True)))
        image = residual(Y, second(self._over, free, free)) * column(Z) - drift
        inside = all(abs(x) < z.rad() for x, z in zip(image.entries(), Z, strict=True))
        return inside and is_single(self.U, self._leaves_over, self._all_over)

    def _reduce(self) -> None:
        """Set the bounds of the least energy."""
        along, free, at, over = self.along, self.U.free, self._at, self._over
        self.value, self.gradient = constant(at), first(at, along)
        self.H = second(over, along, along)
        if free:
            ab, bb = second(over, along, free), second(over, free, free)
            g, least = first(at, free), bb.inv(nonstop=True)
            zeta = -least * g  # that of the minimiser at the middle
            self.value += (g.transpose() * zeta + zeta.transpose() * bb * zeta / 2)[0, 0]
            self.gradient += ab * zeta
            self.H -= ab * least * ab.transpose()

    # -- bounds -----------------------------------------------------------------------------------

    @cached_property
    def slopes(self) -> list[Ball]:
        """∇U over the box, by `along`: from its terms or by the mean value theorem."""
        by_mean = (self.gradient + self.H * self.step).entries()
        by_terms = (derivative(self._over, i) for i in self.along)
        return [narrower(a, b) for a, b in zip(by_terms, by_mean, strict=True)]

    def outwards(self, face: Face) -> Ball:
        """Return the slope of U outwards through a face, over the box."""
        return self.slopes[face.axis] * face.side

    def _combined(self, rows: Matrix, columns: Sequence[int]) -> list[Ball]:
        """Return rows times ∂U/∂Θ over the box by the mean value theorem; ways by some columns."""
        by_mean = rows * part(self.H, self.axes, columns) * part(self.step, columns)
        return (rows * part(self.gradient, self.axes) + by_mean).entries()

    def excludes_zero(self) -> str | None:
        """Return which combination of ∂U/∂Θ has no zero in the box, or None."""
        for name, components in self._components():
            for axis, v in zip(self.axes, components, strict=True):
                if v > 0 or v < 0:
                    return f"{name}{axis + 1}"
        return None

    def _components(self) -> Iterator[tuple[str, list[Ball]]]:
        yield "g", [self.slopes[i] for i in self.axes]
        every = range(len(self.along))
        yield "y", self._combined(inverse(part(self.H, self.axes, self.axes)), every)
        if len(self.jumps) == 1 and self.face is None:  # across these, no force jumps
            x, y, z = (self.H[i, 3].mid() for i in self.axes)
            yield "j", self._combined(arb_mat([[y, -x, 0], [z, 0, -x], [0, z, -y]]), every)

    def at_least(self, bound: Ball) -> bool:
        """Return whether U is at least a bound on the box."""
        if not self.value >= bound:
            return False
        return bool(constant(self._over) >= bound or self.value + self._least(1) >= bound)

    def below(self, bound: Ball) -> bool:
        """Return whether U is below a bound on the box."""
        return bool(self.value < bound and self.value - self._least(-1) < bound)

    def _least(self, sign: int) -> Ball:
        """Return a bound from below of ±(U - U(m)) over the box."""
        reach = [x.abs_upper() for x in self.step.entries()]
        return least_of((sign * self.gradient).entries(), (sign * self.H).tolist(), reach)

    # -- a state at rest --------------------------------------------------------------------------

    @property
    def _rows(self) -> list[int]:
        """The rows of `axes` and `jumps`."""
        return [k for k, i in enumerate(self.along) if self.face is None or i != self.face.axis]

    @cached_property
    def _system(self) -> tuple[Matrix, Matrix, Matrix]:
        """F(m), ∂F over the box, and the ways: F is ∇U, and where a force jumps h of its step."""
        rows = self._rows
        F, J = part(self.gradient, rows), part(self.H, rows, rows)
        for row, k in enumerate(self.jumps, start=len(self.axes)):
            h_at, h = self._argument_of(k)
            F[row, 0] = constant(h_at)
            for j, i in enumerate(rows):
                J[row, j] = derivative(h, self.along[i])
        return F, J, part(self.step, rows)

    def side(self, share: int) -> int:
        """Return the sign of h over the box, of the step for which a variable stands, or 0."""
        h = constant(self._all_over[share_of(share)])
        return 1 if h > 0 else -1 if h < 0 else 0

    def _argument_of(self, share: int) -> tuple[Series, Series]:
        """Return h at the middle and over the box, of the step for which a variable stands."""
        k = share_of(share)
        return self._all_at[k], self._all_over[k]

    def is_injective(self) -> bool:
        """Return whether F takes each value once in the box: |I - Y∂F| < 1 in some norm."""
        _, J, step = self._system
        d = column([x.abs_upper() for x in step.entries()])
        R = arb_mat([[abs(x) for x in row] for row in residual(inverse(J), J).tolist()])
        return all(x < most for x, most in zip((R * d).entries(), d.entries(), strict=True))

    def contains_zero(self) -> bool:
        """Return whether F has a zero in the box, and then only one (Krawczyk's test)."""
        F, J, step = self._system
        Y = inverse(J)
        image = (residual(Y, J) * step - Y * F).entries()
        ways = [*self.axes, *self.jumps]
        return all(abs(x) < self.half[i] for i, x in zip(ways, image, strict=True))

    @property
    def index(self) -> int | None:
        """The number of negative eigenvalues of ∇²U, all over the box; None if it is not known.

        Each λ adds one: along the surface where a force jumps there is one less.
        """
        negatives = negative(part(self.H, self._rows, self._rows))
        return None if negatives is None else negatives - len(self.jumps)

    def share_at_rest(self, *, ridge: bool) -> tuple[float, float] | None:
        """Return between which λ the slope of U across a surface is zero, where a force jumps.

        Returns:
            The ends of λ. None if U may have no slopes of opposite signs on both sides, so that
            there may be a rest state beside the surface.
        """
        (k,) = self.jumps
        _, h = self._argument_of(k)
        normal = arb_mat([[derivative(h, i).mid() for i in self.axes]])
        (halfway,) = self._combined(normal, self.axes)
        growth = (normal * part(self.H, self.axes, [3]))[0, 0]
        before, after = halfway - growth / 2, halfway + growth / 2
        linear = (k, k) not in self._over
        if not (linear and (before > 0 and after < 0 if ridge else before < 0 and after > 0)):
            return None
        share = arb(0.5) - halfway / growth
        low = max(float(share.lower()) - ROUNDING, 0.0)
        high = min(float(share.upper()) + ROUNDING, 1.0)
        return (low, high) if low <= high else None


def first(x: Series, rows: Sequence[int]) -> Matrix:
    """Return first derivatives of a series as a column."""
    return column([derivative(x, i) for i in rows])


def second(x: Series, rows: Sequence[int], columns: Sequence[int]) -> Matrix:
    """Return second derivatives of a series as a matrix.

    Args:
        x: The series.
        rows: The number of the variable of each row.
        columns: The number of the variable of each column.
    """
    return arb_mat([[derivative(x, i, j) for j in columns] for i in rows])


def least_of(a: Sequence[Ball], A: Sequence[Sequence[Ball]], reach: Sequence[Ball]) -> Ball:
    """Return a bound from below of a'x + ½ x'Ax for |x_i| <= reach_i.

    Of the first x, p x²/2 + b x is at least -b²/2p, where b depends on the other x (then these have
    the Schur complement left), or it is bounded for the largest |b|: the better of both counts.

    Args:
        a: The slopes, shape (n,).
        A: The second derivatives, shape (n, n).
        reach: The largest |x_i|, shape (n,).
    """
    if not a:
        return arb(0)
    (q, *others), (p, *row), h, n = a, A[0], reach[0], range(len(a) - 1)
    inner = [entries[1:] for entries in A[1:]]
    most = sum((abs(c) * r for c, r in zip(row, reach[1:], strict=True)), abs(q))
    if p > 0:
        of_first = -most * h + p * h * h / 2 if most >= p * h else -most * most / (2 * p)
    else:
        of_first = -most * h + p * arb(h * h / 4, h * h / 4)
    by_range = of_first + least_of(others, inner, reach[1:])
    if not p > 0:
        return by_range
    share = [c / p for c in row]
    left = [x - q * s for x, s in zip(others, share, strict=True)]
    schur = [[inner[i][j] - row[i] * share[j] for j in n] for i in n]
    by_square = least_of(left, schur, reach[1:]) - q * q / (2 * p)
    return by_square if by_square.lower() > by_range.lower() else by_range
