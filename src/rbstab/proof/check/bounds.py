"""An energy and its derivatives over a box: theorem 1 of docs/proofs.md, in balls.

With the middle m of a box, δ = Θ - m, and third derivatives T over all of it,

    ∇U = ∇U(m) + (H(m) + ½Tδ)δ        U = U(m) + ∇U(m)'δ + ½ δ'(H(m) + ⅓Tδ)δ.

Variables z beyond the box are chosen so that U is least. With z = ẑ + Cδ + ζ, where ẑ is near the
minimiser at the middle m, and C near its derivative, this least energy V has

    ∇V = U_δ        ∇²V = U_δδ - U_δζ U_ζζ⁻¹ U_ζδ        where U_ζ = 0.

Krawczyk's test for U_ζ = 0 shows that a stationary point has ζ in a box Z for all Θ of the box. By
`convex` there is no other, and it is the minimiser.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

from flint import arb, arb_mat

from rbstab.proof.check.convex import is_single, minors
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import Box
from rbstab.proof.check.taylor import ORDER, UNKNOWN, Ball, narrower

Matrix = Any
"""An `arb_mat` of python-flint."""

STEPS = 40
"""The most steps of Newton's method for ẑ."""


class Bounds:
    """Bounds of an energy over a box.

    Args:
        U: The energy.
        box: The box, of its first variables; over all others U is least.
        flat: A variable and its exact value, a ball: then the box is flat there, and only
            derivatives along the others count.

    Attributes:
        axes: The variables along which the box is not flat.
        middle: m.
        step: δ, for the variables `axes`.
        value: U(m).
        over: U over the box, from its terms.
        gradient: ∇U(m).
        gradient_over: ∇U over the box, from its terms.
        H: H(m).
        slope, bend, hessian: H(m) + ½Tδ, H(m) + ⅓Tδ, and H(m) + Tδ.
    """

    def __init__(self, U: Energy, box: Box, flat: tuple[int, Ball] | None = None) -> None:
        self.U, self.box, self.flat = U, box, flat
        self.axes = [i for i in range(len(box)) if flat is None or i != flat[0]]
        self.free = range(len(box), U.n)
        self.middle, self.steps = centre_and_steps(box)
        if flat is not None:
            self.middle[flat[0]], self.steps[flat[0]] = flat[1], arb(0)
        self.step = column([self.steps[i] for i in self.axes])
        self._way: list[Ball] = [*self.steps, *(UNKNOWN for _ in self.free)]
        if self.free:
            self._follow()
        else:
            self._evaluate_at()
        if not self._encloses_minimiser():
            self._at = self._over = dict.fromkeys(range(len(U.rows.rows)), UNKNOWN)
        self._reduce()

    # -- where the minimiser is -------------------------------------------------------------------

    def _evaluate_at(self) -> None:
        """Evaluate U at the middle."""
        self._all_at = self.U(self._leaves([arb(0)] * self.U.n), 2)
        self._at = self._all_at[-1]

    def _evaluate_over(self, Z: Sequence[Ball]) -> None:
        """Evaluate U over the box, with ζ in Z."""
        self._way = [*self.steps, *Z]
        about = (self._all_at, self._way)
        self._all_over = self.U(self._leaves(self._way), ORDER, about)
        self._over = self._all_over[-1]

    def _leaves(self, way: Sequence[Ball]) -> list[dict[int, Ball]]:
        """Return the series of all variables in δ and ζ."""
        n, leaf = len(self.box), self.U.rows.leaf
        found = [leaf(i, self.middle[i] + way[i]) for i in range(n)]
        for j, k in enumerate(self.free):
            C = [self._C[j, i] for i in range(n)]
            z = self._zhat[j] + sum((c * d for c, d in zip(C, way, strict=False)), arb(0)) + way[k]
            along = {self.U.rows.first[i]: c for i, c in enumerate(C) if c != 0}
            found.append(leaf(k, z) | along)
        return found

    def _follow(self) -> None:
        """Find ẑ and C by Newton's method, from where the last box ended."""
        nothing = [arb(0)] * len(self.free)
        self._C = arb_mat(len(self.free), len(self.box))
        self._zhat: Sequence[Ball] = self.U.last or nothing
        for _ in range(STEPS):
            self._evaluate_at()
            Y = inverse(self._second(self._at, self.free, self.free))
            if Y is None:
                self._zhat = nothing
                break
            step = (Y * self._first(self._at, self.free)).mid().entries()
            self._zhat = [(z - s).mid() for z, s in zip(self._zhat, step, strict=True)]
            if all(abs(s) < 1e-20 for s in step):
                C = -Y * self._second(self._at, self.free, range(len(self.box)))
                self._C = C.mid()
                break
        if all(z.is_finite() for z in self._zhat):
            self.U.last = self._zhat
        self._evaluate_at()

    def _encloses_minimiser(self) -> bool:
        """Evaluate U over the box, and return whether Z contains ζ for all Θ (Krawczyk's test)."""
        free, Z = self.free, list[Ball]()
        if free:
            Y = inverse(self._second(self._at, free, free))
            if Y is None:
                return False
            self._evaluate_over([arb(0)] * len(free))
            drift = Y * (
                self._first(self._at, free) + self._means(free, self.axes, 2)[0] * self.step
            )
            if not finite(drift):
                return False
            Z = [arb(0, 2 * x.abs_upper() + 1e-30) for x in drift.entries()]
        self._evaluate_over(Z)
        if not free:
            return True
        leaves = self._leaves(self._way)
        image = residual(Y, self._means(free, free, 1)[0]) * column(Z) - drift
        inside = all(abs(x) < z.rad() for x, z in zip(image.entries(), Z, strict=True))
        return inside and is_single(self.U, leaves, self._all_over)

    def _first(self, x: dict[int, Ball], rows: Sequence[int]) -> Matrix:
        return column([self.U.rows.derivative(x, i) for i in rows])

    def _second(self, x: dict[int, Ball], rows: Sequence[int], columns: Sequence[int]) -> Matrix:
        D = self.U.rows.derivative
        return matrix([[D(x, i, j) for j in columns] for i in rows], len(columns))

    def _third(self, rows: Sequence[int], columns: Sequence[int], by: Sequence[int]) -> Matrix:
        D, over, way = self.U.rows.derivative, self._over, self._way
        T = [[sum((D(over, i, j, k) * way[k] for k in by), arb(0)) for j in columns] for i in rows]
        return matrix(T, len(columns))

    def _means(self, rows: Sequence[int], columns: Sequence[int], *parts: int) -> list[Matrix]:
        """Return H(m) + Tδ/part + Tζ, or second derivatives over the box if it has no bound."""
        H, T = self._second(self._at, rows, columns), self._third(rows, columns, self.axes)
        if self.free:
            H += self._third(rows, columns, self.free)
        # Where H(m) is not known, as at a switch, its bounds over the box may be.
        if not finite(H + T):
            return [self._second(self._over, rows, columns)] * len(parts)
        return [H + T / part for part in parts]

    def _reduce(self) -> None:
        """Set the bounds of the least energy."""
        axes, free, at, over = self.axes, self.free, self._at, self._over
        self.value: Ball = at.get(0, arb(0))
        self.over: Ball = over.get(0, arb(0))
        self.gradient = self._first(at, axes)
        self.gradient_over: list[Ball] = self._first(over, axes).entries()
        self.H = self._second(at, axes, axes)
        self.hessian, self.slope, self.bend = self._means(axes, axes, 1, 2, 3)
        if not free:
            return
        (ab,), (bb,) = self._means(axes, free, 1), self._means(free, free, 1)
        g, least = self._first(at, free), inverses(bb)
        zeta = -least * g  # that of the minimiser at the middle
        self.value += (g.transpose() * zeta + zeta.transpose() * bb * zeta / 2)[0, 0]
        self.gradient += ab * zeta
        schur = ab * least * ab.transpose()
        self.hessian, self.slope, self.bend = (
            M - schur for M in (self.hessian, self.slope, self.bend)
        )

    # -- bounds -----------------------------------------------------------------------------------

    @property
    def normal(self) -> Ball:
        """∂U over the box along the flat variable, from its terms or by the mean value theorem."""
        assert self.flat is not None
        D, axis = self.U.rows.derivative, self.flat[0]
        by_mean = D(self._at, axis)
        for i in (*self.axes, *self.free):
            by_mean += D(self._over, axis, i) * self._way[i]
        return narrower(D(self._over, axis), by_mean)

    @property
    def slopes(self) -> list[Ball]:
        """∇U over the box, from its terms or by the mean value theorem."""
        by_mean = self.gradient + self.slope * self.step
        return [narrower(a, b) for a, b in zip(self.gradient_over, by_mean.entries(), strict=True)]

    def excludes_zero(self) -> str | None:
        """Return a component of ∇U, or of Y∇U with a matrix Y, that has no zero in the box."""
        for name, components in self._components():
            for axis, v in zip(self.axes, components, strict=True):
                if misses_zero(v):
                    return f"{name}{axis + 1}"
        return None

    def _components(self) -> Iterator[tuple[str, list[Ball]]]:
        yield "g", self.gradient_over
        yield "g", self.slopes
        Y = inverse(self.slope)
        if Y is not None:
            yield "y", (Y * self.gradient + (Y * self.slope) * self.step).entries()

    @property
    def values(self) -> Ball:
        """U over the box, by Taylor's theorem."""
        total, n = self.value, range(len(self.axes))
        d, M = self.step, self.bend
        for i in n:
            square = d[i, 0].abs_upper() ** 2
            total += self.gradient[i, 0] * d[i, 0] + M[i, i] * arb(square / 4, square / 4)
            total += sum((M[i, j] * d[i, 0] * d[j, 0] for j in n if j > i), arb(0))
        return total

    def at_least(self, bound: Ball) -> bool:
        """Return whether U is at least a bound on the box."""
        if self.values >= bound or self.over >= bound:
            return True
        # A definite H(m): the least value of the quadratic part, wherever it is.
        if not all(minor > 0 for minor in minors(self.H)):
            return False
        g, d = self.gradient, self.step
        rest = (d.transpose() * (self.bend - self.H) * d)[0, 0] / 2
        return bool(self.value - (g.transpose() * inverses(self.H) * g)[0, 0] / 2 + rest >= bound)

    # -- a zero of ∇U -----------------------------------------------------------------------------

    def one_to_one(self) -> bool:
        """Return whether ∇U takes each value once in the box: |I - Y∇²U| < 1 in some norm."""
        Y = inverse(self.H)
        if Y is None:
            return False
        R, n = residual(Y, self.hessian), range(len(self.axes))
        d = [self.step[i, 0].abs_upper() for i in n]
        return all(sum((abs(R[i, j]) * d[j] for j in n), arb(0)) < d[i] for i in n)

    def contains_zero(self) -> bool:
        """Return whether ∇U has a zero in the box (Krawczyk's test)."""
        Y = inverse(self.H)
        if Y is None:
            return False
        image = -(Y * self.gradient) + residual(Y, self.slope) * self.step
        ends = [
            (self.middle[i] + x, self.box[i])
            for i, x in zip(self.axes, image.entries(), strict=True)
        ]
        return all(x > arb(low) and x < arb(high) for x, (low, high) in ends)

    @property
    def index(self) -> int | None:
        """The number of negative eigenvalues of each ∇²U in the box; None if it is not known.

        By Jacobi's rule. A minor may be zero, so a matrix L'HL with the same number is tried too.
        """
        H, n = self.hessian, range(len(self.axes))
        L = matrix([[arb(i + 2) / (j + 5) if i > j else int(i == j) for j in n] for i in n])
        for one in (H, L.transpose() * H * L):
            signs = [1, *(1 if m > 0 else -1 if m < 0 else 0 for m in minors(one))]
            if 0 not in signs:
                return sum(a != b for a, b in pairwise(signs))
        return None


def centre_and_steps(box: Box) -> tuple[list[Ball], list[Ball]]:
    """Return the middle of a box, which is exact, and balls about 0 that reach its ends."""
    middle = [a / 2 + b / 2 for a, b in box]
    steps = [
        arb(0, max((arb(b) - m).upper(), (arb(m) - a).upper(), key=float))
        for m, (a, b) in zip(middle, box, strict=True)
    ]
    return [arb(m) for m in middle], steps


def matrix(rows: Sequence[Sequence[Any]], columns: int | None = None) -> Matrix:
    """Return a matrix, which may have no rows or no columns."""
    width = len(rows[0]) if rows else 0
    return arb_mat(len(rows), width if columns is None else columns, [x for r in rows for x in r])


def column(entries: Sequence[Ball]) -> Matrix:
    """Return a column of a matrix."""
    return arb_mat(len(entries), 1, list(entries))


def misses_zero(x: Ball) -> bool:
    """Return whether 0 is not in a ball."""
    return bool(x > 0 or x < 0)


def finite(M: Matrix) -> bool:
    """Return whether all entries of a matrix have bounds."""
    return all(x.is_finite() for x in M.entries())


def inverse(H: Matrix) -> Matrix | None:
    """Return a matrix near the inverse of another; None if there is none."""
    try:
        Y = H.mid().inv().mid()
    except ZeroDivisionError:
        return None
    return Y if finite(Y) else None


def inverses(H: Matrix) -> Matrix:
    """Return a matrix that contains the inverses of all matrices in another."""
    n = H.nrows()
    try:
        return H.inv()
    except ZeroDivisionError:
        return arb_mat(n, n, [UNKNOWN] * n * n)


def residual(Y: Matrix, H: Matrix) -> Matrix:
    """Return I - YH."""
    n = range(H.nrows())
    return matrix([[int(i == j) for j in n] for i in n]) - Y * H
