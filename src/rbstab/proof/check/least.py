"""V(Θ), the least U(Θ, z) over variables z in which U is convex, and its derivatives over a box.

With z = ẑ + Cδ + ζ, where ẑ is near the minimiser at the middle m, and C near its derivative,

    ∇V = U_δ        ∇²V = U_δδ - U_δζ U_ζζ⁻¹ U_ζδ        where U_ζ = 0.

Krawczyk's test for U_ζ = 0 shows that the minimiser has ζ in a box Z for all Θ of the box. There is
no other: U is a positive definite quadratic form of z, plus functions that are convex in z by the
rules: sums with positive factors, even powers of what is affine in z, powers of what is convex and
not negative, exponentials of what is convex, lengths of vectors that are affine in z. For springs
see `springs`.
"""

from collections.abc import Sequence
from typing import Any

from flint import arb, arb_mat

from rbstab.proof.check.bounds import (
    Bounds,
    Matrix,
    centre_and_steps,
    column,
    entry,
    finite,
    inverse,
    residual,
)
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import Box
from rbstab.proof.check.springs import is_single, springs_of
from rbstab.proof.check.taylor import ORDER, UNKNOWN, Ball, Series

STEPS = 40
ANGLES = 3


class LeastBounds(Bounds):
    """Bounds of V over a box of Θ: all that `Bounds` has.

    Attributes:
        z: Balls that contain the minimiser, for all Θ of the box.
    """

    def __init__(self, U: Energy, box: Box, flat: tuple[int, Ball] | None = None) -> None:
        self.U = U
        self.flat = None if flat is None else flat[0]
        self.axes = [i for i in range(ANGLES) if flat is None or i != flat[0]]
        self.free = list(range(ANGLES, U.n))
        self.middle, self.steps = centre_and_steps(box)
        if flat is not None:
            self.middle[flat[0]], self.steps[flat[0]] = flat[1], arb(0)
        self.step = column([self.steps[i] for i in self.axes])
        self.normal = UNKNOWN
        self._follow()
        at = self._series([arb(0)] * ANGLES, [arb(0)] * len(self.free), 2)
        Y = inverse(self._second(at, self.free, self.free))
        Z = None if Y is None else self._spread(at, Y)
        self.z = [UNKNOWN] * len(self.free)
        self._nothing(at)
        if Z is not None:
            over = self._series(self.steps, Z)
            z = [self._z_over(j, self.steps, Z[j]) for j in range(len(Z))]
            if self._is_inside(at, over, Y, Z) and is_single(U, self._angles(), self._all_over, z):
                self.z = z
                self._with(at, over, Z)

    # -- series in (δ, ζ) -------------------------------------------------------------------------

    def _follow(self) -> None:
        """Find ẑ and C by Newton's method, from where the last box ended."""
        U, self.C = self.U, arb_mat(len(self.free), ANGLES)
        self.zhat: Sequence[Ball] = U.last or [arb(0)] * len(self.free)
        nothing = [arb(0)] * len(self.free)
        for _ in range(STEPS):
            at = self._series([arb(0)] * ANGLES, nothing, 2)
            Y = inverse(self._second(at, self.free, self.free))
            if Y is None:
                self.zhat = nothing
                break
            step = (Y * self._first(at, self.free)).mid().entries()
            self.zhat = [(z - s).mid() for z, s in zip(self.zhat, step, strict=True)]
            if all(abs(s) < 1e-20 for s in step):
                self.C = (-Y * self._second(at, self.free, range(ANGLES))).mid()
                break
        if all(z.is_finite() for z in self.zhat):
            U.last = self.zhat

    def _z_over(self, j: int, steps: Sequence[Ball], Z: Ball) -> Ball:
        return self.zhat[j] + sum((self.C[j, i] * steps[i] for i in range(ANGLES)), arb(0)) + Z

    def _series(self, steps: Sequence[Ball], Z: Sequence[Ball], order: int = 3) -> Series:
        U, first, leaves = self.U, self.U.rows.first, self._angles(steps)
        for j, k in enumerate(self.free):
            x = {0: self._z_over(j, steps, Z[j]), first[k]: arb(1)}
            x |= {first[i]: self.C[j, i] for i in range(ANGLES) if self.C[j, i] != 0}
            leaves[U.variables[k]] = x
        if order < ORDER:
            self._all_at = U.all_series(leaves, order)
            return self._all_at[-1]
        self._all_over = U.all_series(leaves, about=(self._all_at, [*steps, *Z]))
        return self._all_over[-1]

    def _angles(self, steps: Sequence[Ball] | None = None) -> dict[int, Series]:
        """Return the series of Θ, by default over the box."""
        U, steps = self.U, self.steps if steps is None else steps
        pairs = zip(U.variables, self.middle, steps, U.rows.first, strict=False)
        return {k: {0: x + d, row: arb(1)} for k, x, d, row in pairs}

    def _first(self, x: Series, rows: Sequence[int]) -> Matrix:
        return column([x.get(self.U.rows.first[i], arb(0)) for i in rows])

    def _second(self, x: Series, rows: Sequence[int], columns: Sequence[int]) -> Matrix:
        second = self.U.rows.second
        return arb_mat([[entry(x, second[i][j]) for j in columns] for i in rows])

    def _third(self, x: Series, rows: Sequence[int], columns: Sequence[int], by: Any) -> Matrix:
        """Return the matrix of Σ_k T_ijk δ_k for some (k, δ_k)."""
        third = self.U.rows.third
        return arb_mat(
            [
                [sum((entry(x, third[i][j][k]) * d for k, d in by), arb(0)) for j in columns]
                for i in rows
            ]
        )

    # -- where the minimiser is -------------------------------------------------------------------

    def _drift(self, at: Series, over: Series) -> Matrix:
        """Return U_ζ(δ, 0) over the box."""
        by = [(i, self.steps[i]) for i in self.axes]
        H = self._second(at, self.free, self.axes) + self._third(over, self.free, self.axes, by) / 2
        if not finite(H):
            H = self._second(over, self.free, self.axes)
        return self._first(at, self.free) + H * self.step

    def _spread(self, at: Series, Y: Matrix) -> list[Ball] | None:
        """Return Z, which is to be tested."""
        over = self._series(self.steps, [arb(0)] * len(self.free))
        drift = Y * self._drift(at, over)
        if not finite(drift):
            return None
        return [arb(0, 2 * x.abs_upper() + 1e-30) for x in drift.entries()]

    def _is_inside(self, at: Series, over: Series, Y: Matrix, Z: Sequence[Ball]) -> bool:
        """Return whether the minimiser is in Z for all Θ of the box (Krawczyk's test)."""
        R = residual(Y, self._blocks(at, over, Z)[2])
        image = R * column(Z) - Y * self._drift(at, over)
        return all(abs(x) < z.rad() for x, z in zip(image.entries(), Z, strict=True))

    def _blocks(self, at: Series, over: Series, Z: Sequence[Ball], part: int = 1) -> list[Matrix]:
        """Return U_δδ, U_δζ and U_ζζ over the box; with `part`, T along δ is divided by it."""
        a, b = self.axes, self.free
        found = []
        for rows, columns in ((a, a), (a, b), (b, b)):
            by = [(i, self.steps[i] / part) for i in a] + list(zip(b, Z, strict=True))
            M = self._second(at, rows, columns) + self._third(over, rows, columns, by)
            found.append(M if finite(M) else self._second(over, rows, columns))
        return found

    # -- V ----------------------------------------------------------------------------------------

    def _nothing(self, at: Series) -> None:
        n = len(self.axes)
        self.value = self.over = UNKNOWN
        self.gradient, self.gradient_over = column([UNKNOWN] * n), [UNKNOWN] * n
        self.H = self._second(at, self.axes, self.axes)
        self.slope = self.bend = self.hessian = arb_mat([[UNKNOWN] * n for _ in range(n)])

    def _with(self, at: Series, over: Series, Z: Sequence[Ball]) -> None:
        aa, ab, bb = self._blocks(at, over, Z)
        try:
            least = bb.inv()
        except ZeroDivisionError:
            return
        g = self._first(at, self.free)
        zeta = -least * g  # that of the minimiser at the middle
        self.value = (
            at.get(0, arb(0)) + (g.transpose() * zeta + zeta.transpose() * bb * zeta / 2)[0, 0]
        )
        self.over = over.get(0, arb(0))
        self.gradient = self._first(at, self.axes) + ab * zeta
        self.gradient_over = self._first(over, self.axes).entries()
        if self.flat is not None:
            self.normal = self._first(over, [self.flat])[0, 0]
        schur = ab * least * ab.transpose()
        self.hessian = aa - schur
        self.slope, self.bend = (self._blocks(at, over, Z, k)[0] - schur for k in (2, 3))


def minimiser_over(U: Energy, box: Box) -> list[Ball]:
    """Return balls that contain the minimiser z for all Θ of a box, whatever else U has."""
    kind, c0, terms = U.operations[-1]
    with_z = tuple((c, k) for c, k in terms if U.depends[k] & set(U.variables[ANGLES:]))
    return LeastBounds(U.with_operations([*U.operations[:-1], (kind, c0, with_z)]), box).z


def bounds(U: Energy, box: Box, flat: tuple[int, Ball] | None = None) -> Bounds:
    """Return bounds of U, or of the least U if it depends on more than Θ, over a box."""
    return LeastBounds(U, box, flat) if U.free else Bounds(U, box, flat)


CONSTANT, AFFINE, CONVEX = 0, 1, 2


def why_not_convex(U: Energy) -> str | None:
    """Return what is not shown about U as a function of z; None if all but springs is convex."""
    shapes = _shapes(U)
    if U.operations[-1][0] != "sum":
        return "U is no sum"
    springs = springs_of(U)
    for c, j in springs.others:
        if not (shapes[j] in (CONSTANT, AFFINE) or (shapes[j] == CONVEX and c > 0)):
            return f"Operation {j + 1} is not shown to be convex in z"
    return None if springs.stiffness > 0 else "The quadratic form of z is not positive definite"


def _shapes(U: Energy) -> list[int | None]:
    """Return for each operation how it depends on z; None if that is not known."""
    found, positive = list[int | None](), list[bool]()
    z = frozenset(U.free)
    for k, (kind, *rest) in enumerate(U.operations):
        shape: int | None = None
        not_negative = False
        if not U.depends[k] & z:
            shape = CONSTANT
        elif kind == "var":
            shape = AFFINE
        elif kind == "sum":
            parts = [(c, found[j]) for c, j in rest[1]]
            fits = all(s is not None and (s < CONVEX or c > 0) for c, s in parts)
            shape = max((s for _, s in parts if s is not None), default=CONSTANT) if fits else None
            not_negative = rest[0] >= 0 and all(c > 0 and positive[j] for c, j in rest[1])
        elif kind == "times":
            both = sorted((found[j] for j in rest), key=lambda s: CONVEX + 1 if s is None else s)
            shape = AFFINE if both == [CONSTANT, AFFINE] else None
        elif kind == "pow" and rest[0] > 0:
            inner, n = found[rest[1]], rest[0]
            even = n % 2 == 0
            grows = inner == CONVEX and positive[rest[1]]
            shape = CONVEX if (inner == AFFINE and even) or grows else None
            not_negative = even or positive[rest[1]]
        elif kind == "sqrt":
            # The length of a vector that is affine in z.
            shape = CONVEX if _is_sum_of_squares(U.operations[rest[0]], U, found) else None
            not_negative = True
        elif kind == "exp":
            shape, not_negative = (None if found[rest[0]] is None else CONVEX), True
        found.append(shape)
        positive.append(not_negative)
    return found


def _is_sum_of_squares(one: Sequence[Any], U: Energy, shapes: Sequence[int | None]) -> bool:
    if one[0] != "sum" or one[1] < 0:
        return False
    squares = ((c, U.operations[k]) for c, k in one[2])
    return all(
        c > 0 and s[:2] == ("pow", 2) and shapes[s[2]] in (CONSTANT, AFFINE) for c, s in squares
    )
