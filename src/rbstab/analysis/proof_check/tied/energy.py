"""The energy W of a proof for a tied body with springs, in balls.

    W(Θ, z) = U(Θ) + ½ z'Sz + Σ w_j ℓ_j    ℓ_j² = s_j = |z + r_j(Θ)|²

With a barrier on θ2, U has the term ½ k tan² θ2.

All derivatives of ℓ by the six variables follow from ℓ² = s, differentiated once and twice:
2ℓ ℓ_a = s_a and 2ℓ ℓ_ab = s_ab - 2 ℓ_a ℓ_b.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES, Box
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.taylor import symmetric
from rbstab.analysis.proof_check.trigonometric import (
    Axes,
    Ball,
    TrigonometricSum,
    axes_of,
    rounded,
    square,
)

SIX = range(6)

SHIFT = range(3, 6)
"""The places of z in the six variables."""

Orders = tuple[Ball, list[Ball], list[list[Ball]]]
"""A function, its three derivatives by Θ, and its nine second ones."""

MOST_LINES = 50


class FreeLine:
    """The energy w |z + r(Θ)| of a line.

    Args:
        data: The weight w, N, and the coefficients of the three entries of r, m.

    Raises:
        ValueError: w is not negative.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        if not data["weight"] < 0:
            raise ValueError("The weight of a line is not negative")
        self.weight = rounded(data["weight"])
        self.offset = [TrigonometricSum(one) for one in data["offset"]]


class _Quadratic(Energy):
    """U, with the slopes of lines that depend on z too in its bounds."""

    def __init__(self, data: Mapping[str, Any], free: Sequence[FreeLine]) -> None:
        super().__init__(data)
        self.free = free

    def steepest(self, axis: int) -> Ball:
        """Bound the slope of all but the quadratic part: a unit vector times w ∂r/∂θ of lines."""
        total = super().steepest(axis)
        for line in self.free:
            squares = (square(one.steepest(axis)) for one in line.offset)
            total += abs(line.weight) * sum(squares, arb(0)).abs_upper().sqrt()
        return total


class TiedEnergy:
    """W with its derivatives up to order 2.

    Args:
        data: `tied_energy` of a proof.

    Attributes:
        U: Its part without z.
        scale: Bounds on |z_i| at all points with ∂W/∂z = 0, m.

    Raises:
        ValueError: S is not symmetric and positive definite, or a line or U is none that is known.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        S = data["stiffness"]
        if not 0 < len(data["lines"]) <= MOST_LINES:
            raise ValueError(f"The energy has no line, or more than {MOST_LINES}")
        if any(S[i][j] != S[j][i] for i in AXES for j in AXES):
            raise ValueError("The stiffness of z is not symmetric")
        self.stiffness = arb_mat([[rounded(entry) for entry in row] for row in S])
        minors = (arb_mat([self.stiffness.tolist()[i][:n] for i in range(n)]) for n in (1, 2, 3))
        if not all(minor.det() > 0 for minor in minors):
            raise ValueError("The stiffness of z is not positive definite")
        self.compliance = self.stiffness.inv()
        self.lines = [FreeLine(one) for one in data["lines"]]
        plain = {key: data[key] for key in ("quadratic", "linear", "coefficients")}
        plain["barrier"] = data.get("barrier")
        self.U = _Quadratic(plain, self.lines)
        pull = sum((abs(line.weight) for line in self.lines), arb(0))
        rows = [sum((square(self.compliance[i, j]) for j in AXES), arb(0)) for i in AXES]
        self.scale = [(row.sqrt() * pull).abs_upper() for row in rows]


class Pose:
    """U and all r_j over a box of Θ, and at its centre.

    Args:
        W: The energy.
        box: The box of Θ.
        face: An axis and its exact value, a ball. The box is then flat along this axis.

    Attributes:
        step: Θ minus the centre, three balls.
    """

    def __init__(self, W: TiedEnergy, box: Box, face: tuple[int, Ball] | None = None) -> None:
        middle = [low / 2 + high / 2 for low, high in box]
        self.centre = [arb(point) for point in middle]
        self.step = [symmetric(max(b - m, m - a)) for m, (a, b) in zip(middle, box, strict=True)]
        if face is not None:
            self.centre[face[0]], self.step[face[0]] = face[1], arb(0)
        whole = [point + ball for point, ball in zip(self.centre, self.step, strict=True)]
        self.W = W
        sums = [one for line in W.lines for one in line.offset]
        # Each of them is evaluated as often as U.
        W.U.evaluations += 2 * len(sums)
        pairs = [(W.U.smooth(self.centre), W.U.smooth(whole))]
        pairs += [(one.derivatives(self.centre), one.derivatives(whole)) for one in sums]
        self.parts = {
            "centre": [_orders(at_centre) for at_centre, _ in pairs],
            "over": [self._over(*pair) for pair in pairs],
        }
        found = W.U.barrier_on(1)
        if found is not None:
            for where, angle in (("centre", self.centre[1]), ("over", whole[1])):
                parts = self.parts[where]
                parts[0] = _with_barrier(parts[0], found.terms(angle))

    def _over(self, at_centre: Mapping[Axes, Ball], whole: Mapping[Axes, Ball]) -> Orders:
        """Return a function and its derivatives over the box, from the third ones over it."""
        value, slopes, bends = _orders(at_centre)
        third = [[[whole[axes_of(i, j, k)] for k in AXES] for j in AXES] for i in AXES]
        bends = [[bends[i][j] + self._along(third[i][j]) for j in AXES] for i in AXES]
        slopes = [slopes[i] + self._along(bends[i]) for i in AXES]
        return value + self._along(slopes), slopes, bends

    def _along(self, slopes: Sequence[Ball]) -> Ball:
        return sum((a * d for a, d in zip(slopes, self.step, strict=True)), arb(0))

    def at(self, z: Sequence[Ball], where: str = "centre", without: int | None = None) -> "Values":
        """Return W at z, three balls.

        Args:
            z: The shift.
            where: "centre", or "over" the box of Θ.
            without: The index of a line that is left out, or None.
        """
        return Values(self.W, self.parts[where], z, without)

    def offset(self, line: int, where: str) -> list[Orders]:
        """Return the three entries of r of a line."""
        return self.parts[where][1 + 3 * line : 4 + 3 * line]


def _with_barrier(orders: Orders, terms: Sequence[Ball]) -> Orders:
    """Add a function of θ2 and its derivatives."""
    value, slopes, bends = orders
    slopes[1] += terms[1]
    bends[1][1] += terms[2]
    return value + terms[0], slopes, bends


def _orders(found: Mapping[Axes, Ball]) -> Orders:
    bends = [[found[axes_of(i, j)] for j in AXES] for i in AXES]
    return found[()], [found[i,] for i in AXES], bends


class Values:
    """W and its derivatives at a ball of Θ and z.

    Attributes:
        value: W.
        gradient: Its six derivatives.
        pulls: w_j u_j of each line: the derivatives of its energy by z.
    """

    def __init__(
        self, W: TiedEnergy, parts: list[Orders], z: Sequence[Ball], without: int | None
    ) -> None:
        self.W, self.z = W, list(z)
        self.U = parts[0]
        self.pulled = [sum((W.stiffness[i, j] * z[j] for j in AXES), arb(0)) for i in AXES]
        self.value = (
            self.U[0] + sum((a * b for a, b in zip(self.pulled, z, strict=True)), arb(0)) / 2
        )
        self.gradient = [*self.U[1], *self.pulled]
        self.pulls = list[list[Ball]]()
        self.kept = list[tuple[Ball, list[Ball], list[Orders]]]()
        for k, line in enumerate(W.lines):
            if k == without:
                continue
            r = parts[1 + 3 * k : 4 + 3 * k]
            e = [z[i] + r[i][0] for i in AXES]
            s = sum((square(one) for one in e), arb(0))
            length = s.max(arb(0)).sqrt()
            along = [_slope(one, length) for one in e]
            slopes = [sum((along[k] * r[k][1][i] for k in AXES), arb(0)) for i in AXES] + along
            self.value += line.weight * length
            self.gradient = [
                total + line.weight * slope
                for total, slope in zip(self.gradient, slopes, strict=True)
            ]
            self.pulls.append([line.weight * one for one in along])
            self.kept.append((line.weight, [length, *e], r))

    @property
    def shift(self) -> list[Ball]:
        """-S⁻¹Σ w_j u_j: where ∂W/∂z = 0 it is z."""
        force = [sum((pull[i] for pull in self.pulls), arb(0)) for i in AXES]
        C = self.W.compliance
        return [-sum((C[i, j] * force[j] for j in AXES), arb(0)) for i in AXES]

    @property
    def balanced(self) -> bool:
        """Whether the forces can balance: |Sz + Σ w_i u_i| = |w_j| with all other lines i."""
        for k, line in enumerate(self.W.lines):
            others = [pull for i, pull in enumerate(self.pulls) if i != k]
            rest = [self.pulled[i] + sum((one[i] for one in others), arb(0)) for i in AXES]
            if not sum((square(one) for one in rest), arb(0)).overlaps(square(line.weight)):
                return False
        return True

    @property
    def hessian(self) -> Any:
        """The 6x6 matrix of second derivatives; no numbers where a line may have no length."""
        rows = [[self.U[2][i][j] for j in AXES] + [arb(0)] * 3 for i in AXES]
        rows += [[arb(0)] * 3 + [self.W.stiffness[i, j] for j in AXES] for i in AXES]
        for weight, (length, *e), r in self.kept:
            # Half of the derivatives of s.
            first = [sum((e[k] * r[k][1][i] for k in AXES), arb(0)) for i in AXES] + e
            slopes = [one / length for one in first]
            for a in SIX:
                for b in range(a + 1):
                    bend = weight * (_half_second(a, b, e, r) - slopes[a] * slopes[b]) / length
                    rows[a][b] += bend
                    if a != b:
                        rows[b][a] += bend
        return arb_mat(rows)


def _half_second(a: int, b: int, e: Sequence[Ball], r: Sequence[Orders]) -> Ball:
    """Return half of the derivative of s = |e|² by the variables a >= b."""
    if a < 3:
        return sum((r[k][1][a] * r[k][1][b] + e[k] * r[k][2][a][b] for k in AXES), arb(0))
    return r[a - 3][1][b] if b < 3 else arb(int(a == b))


def _slope(entry: Ball, length: Ball) -> Ball:
    """Return an entry of a unit vector: within [-1, 1] also where the length may be 0."""
    unit = arb(0, 1)
    if not length > 0:
        return unit
    return (entry / length).intersection(unit)
