"""An energy and its derivatives over a box: theorem 1 of docs/proofs.md, in balls.

With the middle m of a box, δ = Θ - m, and third derivatives T over all of it,

    ∇U = ∇U(m) + (H(m) + ½Tδ)δ        U = U(m) + ∇U(m)'δ + ½ δ'(H(m) + ⅓Tδ)δ.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from flint import arb, arb_mat

from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import Box
from rbstab.proof.check.taylor import UNKNOWN, Ball, Series, narrower

Matrix = Any
"""An `arb_mat` of python-flint."""


class Bounds:
    """Bounds of an energy over a box.

    Args:
        U: The energy.
        box: The box, of all its variables.
        flat: A variable and its exact value, a ball: then the box is flat there, and only
            derivatives along the others count.

    Attributes:
        axes: The variables along which the box is not flat.
        step: δ, for these.
        value: U(m).
        over: U over the box, from its terms.
        gradient: ∇U(m).
        gradient_over: ∇U over the box, from its terms.
        normal: ∂U over the box along the flat variable; None without one.
        H: H(m).
        slope, bend, hessian: H(m) + ½Tδ, H(m) + ⅓Tδ, and H(m) + Tδ.
    """

    def __init__(self, U: Energy, box: Box, flat: tuple[int, Ball] | None = None) -> None:
        n, rows = range(U.n), U.rows
        self.axes = [i for i in n if flat is None or i != flat[0]]
        middle, steps = centre_and_steps(box)
        if flat is not None:
            middle[flat[0]], steps[flat[0]] = flat[1], arb(0)
        self.U, self.middle, self.steps = U, middle, steps
        all_at = U.all_series(self._leaves(middle), 2)
        over = self._leaves([x + d for x, d in zip(middle, steps, strict=True)])
        at, whole = all_at[-1], U.all_series(over, about=(all_at, steps))[-1]
        axes, zero = self.axes, arb(0)
        self.step = column([steps[i] for i in axes])
        self.value, self.over = at.get(0, zero), whole.get(0, zero)
        self.gradient = column([at.get(rows.first[i], zero) for i in axes])
        self.gradient_over = [whole.get(rows.first[i], zero) for i in axes]
        self.normal: Ball = UNKNOWN if flat is None else self._slope_across(flat[0], at, whole)
        self.H = arb_mat([[entry(at, rows.second[i][j]) for j in axes] for i in axes])
        T = [
            [sum((entry(whole, rows.third[i][j][k]) * steps[k] for k in axes), zero) for j in axes]
            for i in axes
        ]
        self.T = arb_mat(T)
        # Where H(m) is not known, as at a switch, its bounds over the box may be.
        natural = arb_mat([[entry(whole, rows.second[i][j]) for j in axes] for i in axes])
        sharp = finite(self.H + self.T)
        self.slope, self.bend, self.hessian = (
            (self.H + self.T / 2, self.H + self.T / 3, self.H + self.T)
            if sharp
            else (natural, natural, natural)
        )

    def _leaves(self, values: Sequence[Ball]) -> dict[int, Series]:
        U = self.U
        pairs = zip(U.variables, values, U.rows.first, strict=True)
        return {name: {0: x, row: arb(1)} for name, x, row in pairs}

    def _slope_across(self, axis: int, at: Series, whole: Series) -> Ball:
        """Return the slope along the flat variable, from its terms or by the mean value theorem."""
        rows, zero = self.U.rows, arb(0)
        natural = whole.get(rows.first[axis], zero)
        by_mean = at.get(rows.first[axis], zero)
        for i, d in zip(self.axes, self.step.entries(), strict=True):
            by_mean += entry(whole, rows.second[axis][i]) * d
        return narrower(natural, by_mean)

    @property
    def slopes(self) -> list[Ball]:
        """∇U over the box, from its terms or by the mean value theorem."""
        by_mean = self.gradient + self.slope * self.step
        return [narrower(a, b) for a, b in zip(self.gradient_over, by_mean.entries(), strict=True)]

    def excludes_zero(self) -> str | None:
        """Return a component of ∇U, or of Y∇U with a matrix Y, that has no zero in the box."""
        for k, v in enumerate([*self.gradient_over, *self.slopes]):
            if misses_zero(v):
                return f"g{self.axes[k % len(self.axes)] + 1}"
        Y = inverse(self.slope)
        if Y is not None:
            turned = Y * self.gradient + (Y * self.slope) * self.step
            for k, v in enumerate(turned.entries()):
                if misses_zero(v):
                    return f"y{self.axes[k] + 1}"
        return None

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
        slopes = zip(self.gradient_over, self.step.entries(), strict=True)
        if self.value + sum((g * d for g, d in slopes), arb(0)) >= bound:
            return True
        # A definite H(m): the least value of the quadratic part, wherever it is.
        if not all(minor > 0 for minor in minors(self.H)):
            return False
        g, d = self.gradient, self.step
        try:
            fall = (g.transpose() * self.H.inv() * g)[0, 0] / 2
        except ZeroDivisionError:
            return False
        return bool(
            self.value - fall + (d.transpose() * (self.bend - self.H) * d)[0, 0] / 2 >= bound
        )

    # -- a zero of ∇U -----------------------------------------------------------------------------

    def one_to_one(self) -> bool:
        """Return whether ∇U takes each value once in the box: |I - Y∇²U| < 1 in some norm."""
        Y = inverse(self.H)
        return Y is not None and self._contracts(residual(Y, self.hessian))

    def _contracts(self, R: Matrix) -> bool:
        """Return whether |R|d < d for the radii d of the box."""
        n = range(len(self.axes))
        d = [self.step[i, 0].abs_upper() for i in n]
        return all(sum((abs(R[i, j]) * d[j] for j in n), arb(0)) < d[i] for i in n)

    def contains_zero(self, box: Box) -> bool:
        """Return whether ∇U has a zero in the box (Krawczyk's test), which is given once more."""
        Y = inverse(self.H)
        if Y is None:
            return False
        image = -(Y * self.gradient) + residual(Y, self.slope) * self.step
        found = True
        for k, i in enumerate(self.axes):
            low, high = box[i]
            x = self.middle[i] + image[k, 0]
            found = found and bool(x > arb(low)) and bool(x < arb(high))
        return found

    @property
    def index(self) -> int | None:
        """The number of negative eigenvalues of each ∇²U in the box; None if it is not known."""
        return index_of(self.hessian)


def centre_and_steps(box: Box) -> tuple[list[Ball], list[Ball]]:
    """Return the middle of a box, which is exact, and balls about 0 that reach its ends."""
    middle = [a / 2 + b / 2 for a, b in box]
    steps = [
        arb(0, max((arb(b) - m).upper(), (arb(m) - a).upper(), key=float))
        for m, (a, b) in zip(middle, box, strict=True)
    ]
    return [arb(m) for m in middle], steps


def entry(x: Series, place: tuple[int, int]) -> Ball:
    """Return a derivative: a coefficient times a factor."""
    row, factor = place
    return x[row] * factor if row in x else arb(0)


def column(entries: Sequence[Ball]) -> Matrix:
    """Return a column of a matrix."""
    return arb_mat([[x] for x in entries])


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


def residual(Y: Matrix, H: Matrix) -> Matrix:
    """Return I - YH."""
    n = H.nrows()
    return arb_mat([[int(i == j) for j in range(n)] for i in range(n)]) - Y * H


def minors(H: Matrix) -> list[Ball]:
    """Return the leading minors of a matrix."""
    return [
        arb_mat([[H[i, j] for j in range(n)] for i in range(n)]).det()
        for n in range(1, H.nrows() + 1)
    ]


def index_of(H: Matrix) -> int | None:
    """Return the number of negative eigenvalues of a symmetric matrix (Jacobi's rule).

    A minor may be zero, so a second matrix L'HL is tried, which has the same number.
    """
    n = H.nrows()
    L = arb_mat(
        [
            [1 if i == j else arb(i + 2) / (j + 5) if i > j else 0 for j in range(n)]
            for i in range(n)
        ]
    )
    for one in (H, L.transpose() * H * L):
        signs = [1, *(1 if m > 0 else -1 if m < 0 else 0 for m in minors(one))]
        if 0 not in signs:
            return sum(a != b for a, b in pairwise(signs))
    return None
