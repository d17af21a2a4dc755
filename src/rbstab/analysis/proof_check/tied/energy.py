"""The energy W of a proof for a tied body in six variables, in balls.

    W(Θ, z) = U(Θ) + ½ z'Sz + Σ w_j ℓ_j + Σ Φ_j(ℓ_j) + Σ f_j(Θ, X)    ℓ_j² = s_j = |z + r_j(Θ)|²

with springs, ligaments, and formulas of elements of users; X = X*(Θ) + z. Guards add
functions of single angles to U.

All derivatives of ℓ by the six variables follow from ℓ² = s, differentiated once and twice:
2ℓ ℓ_a = s_a and 2ℓ ℓ_ab = s_ab - 2 ℓ_a ℓ_b. So a function E(ℓ) has the second derivatives
(E'/ℓ) ½ s_ab + (E'' - E'/ℓ) ℓ_a ℓ_b.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES, Box
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.formulas import series
from rbstab.analysis.proof_check.formulas.series import Series
from rbstab.analysis.proof_check.guards import SwitchingGuard
from rbstab.analysis.proof_check.lengths.free_ligament import FreeLigament
from rbstab.analysis.proof_check.taylor import symmetric
from rbstab.analysis.proof_check.tied.formula import FreeFormula, Orders
from rbstab.analysis.proof_check.trigonometric import (
    Axes,
    Ball,
    TrigonometricSum,
    axes_of,
    rounded,
    square,
)

SIX = range(6)

LOWER = [(a, b) for a in SIX for b in range(a + 1)]
"""The entries of a symmetric matrix from which all others follow."""

SHIFT = range(3, 6)
"""The places of z in the six variables."""

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
    """U, with the slopes of what depends on z too in its bounds.

    Attributes:
        slopes: Bounds on these slopes by the three angles, wherever ∂W/∂z = 0.
    """

    slopes: Sequence[Ball]

    def steepest(self, axis: int) -> Ball:
        """Bound the slope of all but the quadratic part."""
        return super().steepest(axis) + self.slopes[axis]


class TiedEnergy:
    """W with its derivatives up to order 2.

    Args:
        data: `tied_energy` of a proof.

    Attributes:
        U: Its part without z.
        pull: Σ |w_j|, N.

    Raises:
        ValueError: S is not symmetric and positive definite, a line or U is none that is known, or
            a formula is not convex in X.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        S = data["stiffness"]
        ligaments, formulas = (data.get(key) or () for key in ("ligaments", "formulas"))
        if not 0 < len(data["lines"]) + len(ligaments) + len(formulas) <= MOST_LINES:
            raise ValueError(f"The energy has no line, or more than {MOST_LINES}")
        if any(S[i][j] != S[j][i] for i in AXES for j in AXES):
            raise ValueError("The stiffness of z is not symmetric")
        self.stiffness = arb_mat([[rounded(entry) for entry in row] for row in S])
        minors = (arb_mat([self.stiffness.tolist()[i][:n] for i in range(n)]) for n in (1, 2, 3))
        if not all(minor.det() > 0 for minor in minors):
            raise ValueError("The stiffness of z is not positive definite")
        self.compliance = self.stiffness.inv()
        self.lines = [FreeLine(one) for one in data["lines"]]
        self.ligaments = [FreeLigament(one) for one in ligaments]
        self.formulas = [FreeFormula(one) for one in formulas]
        position = data.get("position") if formulas else ()
        self.position = [TrigonometricSum(one) for one in position or ()]
        if formulas and len(self.position) != len(AXES):
            raise ValueError("The position is not known")
        plain = {key: data[key] for key in ("quadratic", "linear", "coefficients")}
        plain |= {key: data.get(key) for key in ("barrier", "outer_barrier", "soft_guards")}
        self.U = _Quadratic(plain)
        self.pull = sum((abs(line.weight) for line in self.lines), arb(0))

    @property
    def is_smooth(self) -> bool:
        """Whether ligaments or formulas make it stiffer in z than S."""
        return bool(self.ligaments or self.formulas)


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
        lines: list[FreeLine | FreeLigament] = [*W.lines, *W.ligaments]
        sums = [one for line in lines for one in line.offset] + W.position
        # Each of them is evaluated as often as U.
        W.U.evaluations += 2 * len(sums) + 8 * sum(one.cost for one in W.formulas)
        pairs = [(W.U.smooth(self.centre), W.U.smooth(whole))]
        pairs += [(one.derivatives(self.centre), one.derivatives(whole)) for one in sums]
        self.parts = {
            "centre": [_orders(at_centre) for at_centre, _ in pairs],
            "over": [self._over(*pair) for pair in pairs],
        }
        for where, Theta in (("centre", self.centre), ("over", whole)):
            for barrier in W.U.barriers:
                _add(self.parts[where][0], barrier.axis, barrier.terms(Theta[barrier.axis]))
            for guard in W.U.guards:
                _add(self.parts[where][0], 1, _terms(guard, Theta[1]))

    def _over(self, at_centre: Mapping[Axes, Ball], whole: Mapping[Axes, Ball]) -> list[Any]:
        """Return a function and its derivatives over the box, from the third ones over it."""
        value, slopes, bends = _orders(at_centre)
        third = [[[whole[axes_of(i, j, k)] for k in AXES] for j in AXES] for i in AXES]
        bends = [[bends[i][j] + self._along(third[i][j]) for j in AXES] for i in AXES]
        slopes = [slopes[i] + self._along(bends[i]) for i in AXES]
        return [value + self._along(slopes), slopes, bends]

    def _along(self, slopes: Sequence[Ball]) -> Ball:
        return sum((a * d for a, d in zip(slopes, self.step, strict=True)), arb(0))

    def at(self, z: Sequence[Ball], where: str = "centre", without: int | None = None) -> "Values":
        """Return W at z, three balls.

        Args:
            z: The shift.
            where: "centre", or "over" the box of Θ.
            without: The index of a line that is left out, or None.
        """
        return Values(self, where, z, without)

    def offset(self, line: int, where: str) -> Sequence[Orders]:
        """Return the three entries of r of a line; those after all lines are of X*."""
        return self.parts[where][1 + 3 * line : 4 + 3 * line]

    def formula(self, formula: FreeFormula, z: Sequence[Ball], where: str) -> Series:
        """Return the energy of an element of a user as a polynomial of the six variables."""
        number = len(self.W.lines) + len(self.W.ligaments)
        middle, zeros = [one.mid() for one in z], [arb(0)] * 3
        away = [one - point for one, point in zip(z, middle, strict=True)]
        turned = self.step if where == "over" else zeros
        centre = formula.at(self.centre, self.offset(number, "centre"), middle)
        if all(one == 0 for one in (*turned, *away)):
            return centre[-1]
        Theta = [one + step for one, step in zip(self.centre, turned, strict=True)]
        position = self.offset(number, where)
        return formula.at(Theta, position, z, centre, (*turned, *away))[-1]


def _terms(guard: SwitchingGuard, angle: Ball) -> list[Ball]:
    """Return the energy of a soft guard, its slope, and its second derivative if it has one."""
    bend = arb("nan") if guard.jumps(angle) else guard.curvature(angle)
    return [guard.energy(angle), guard.slope(angle), bend]


def _add(orders: list[Any], axis: int, terms: Sequence[Ball]) -> None:
    """Add a function of one angle and its derivatives."""
    value, slopes, bends = orders
    slopes[axis] += terms[1]
    bends[axis][axis] += terms[2]
    orders[0] = value + terms[0]


def _orders(found: Mapping[Axes, Ball]) -> list[Any]:
    """Return a function, its three derivatives by Θ, and its nine second ones."""
    bends = [[found[axes_of(i, j)] for j in AXES] for i in AXES]
    return [found[()], [found[i,] for i in AXES], bends]


class Values:
    """W and its derivatives at a ball of Θ and z.

    Args:
        pose: The box of Θ.
        where: "centre", or "over" the box.
        z: The shift.
        without: The index of a line that is left out, or None.

    Attributes:
        value: W.
        gradient: Its six derivatives.
        pulls: w_j u_j of each spring: the derivatives of its energy by z.
        others: The derivatives by z of the energies of ligaments and formulas.
        force: The derivatives by z of all but U and ½ z'Sz.
    """

    def __init__(self, pose: Pose, where: str, z: Sequence[Ball], without: int | None) -> None:
        self.W, self.z = W, z = pose.W, list(z)
        self.U = pose.parts[where][0]
        self.pulled = [sum((W.stiffness[i, j] * z[j] for j in AXES), arb(0)) for i in AXES]
        self.value = (
            self.U[0] + sum((a * b for a, b in zip(self.pulled, z, strict=True)), arb(0)) / 2
        )
        self.gradient = [*self.U[1], *self.pulled]
        self.pulls = list[list[Ball]]()
        self.others = list[list[Ball]]()
        self.force = [arb(0)] * 3
        self.ends = list[_End]()
        lines: list[FreeLine | FreeLigament] = [*W.lines, *W.ligaments]
        for k, line in enumerate(lines):
            if k == without:
                continue
            end = _End(line, pose.offset(k, where), z)
            self.ends.append(end)
            self._add(end.energy, end.slopes)
            if isinstance(line, FreeLine):
                self.pulls.append(end.slopes[3:])
            else:
                self.others.append(end.slopes[3:])
        self.formulas = [pose.formula(one, z, where) for one in W.formulas]
        for one in self.formulas:
            slopes = [series.slope(one, axis) for axis in SIX]
            self._add(one[series.ZERO], slopes)
            self.others.append(slopes[3:])

    def _add(self, energy: Ball, slopes: Sequence[Ball]) -> None:
        self.value += energy
        self.gradient = [one + other for one, other in zip(self.gradient, slopes, strict=True)]
        self.force = [one + other for one, other in zip(self.force, slopes[3:], strict=True)]

    @property
    def shift(self) -> list[Ball]:
        """-S⁻¹ times the force: where ∂W/∂z = 0 it is z."""
        C = self.W.compliance
        return [-sum((C[i, j] * self.force[j] for j in AXES), arb(0)) for i in AXES]

    @property
    def balanced(self) -> bool:
        """Whether the forces can balance: |Sz + Σ w_i u_i| = |w_j| with all other lines i."""
        for k, line in enumerate(self.W.lines):
            others = [pull for i, pull in enumerate(self.pulls) if i != k] + self.others
            rest = [self.pulled[i] + sum((one[i] for one in others), arb(0)) for i in AXES]
            if not sum((square(one) for one in rest), arb(0)).overlaps(square(line.weight)):
                return False
        return True

    @property
    def hessian(self) -> Any:
        """The 6x6 matrix of second derivatives; no numbers where a line may have no length."""
        rows = [[self.U[2][i][j] for j in AXES] + [arb(0)] * 3 for i in AXES]
        rows += [[arb(0)] * 3 + [self.W.stiffness[i, j] for j in AXES] for i in AXES]
        for a, b in LOWER:
            parts = [end.bend(a, b) for end in self.ends]
            parts += [series.curvature(one, a, b) for one in self.formulas if (b, a) in one]
            for bend in parts:
                rows[a][b] += bend
                if a != b:
                    rows[b][a] += bend
        return arb_mat(rows)


class _End:
    """The energy E(ℓ) of a line, with its derivatives by the six variables.

    Attributes:
        energy: E.
        slopes: Its six derivatives.
    """

    def __init__(
        self, line: FreeLine | FreeLigament, r: Sequence[Orders], z: Sequence[Ball]
    ) -> None:
        self.r = r
        self.e = [z[i] + r[i][0] for i in AXES]
        s = sum((square(one) for one in self.e), arb(0))
        if isinstance(line, FreeLine):
            length = s.max(arb(0)).sqrt()
            first, self.across = line.weight, line.weight / length
            self.excess, self.energy = -self.across, line.weight * length
        else:
            # Where it is slack, all derivatives are 0; they are those at ℓ₀ too.
            length = s.max(square(line.law.slack_length)).sqrt()
            self.energy, first, _, _ = line.law.derivatives(length)
            self.across, self.excess = line.law.across_and_excess(length)
        u = [_slope(one, length) for one in self.e]
        turned = [sum((u[k] * r[k][1][i] for k in AXES), arb(0)) for i in AXES]
        self.along = turned + u
        self.slopes = [first * one for one in self.along]

    def bend(self, a: int, b: int) -> Ball:
        """Return the second derivative by the variables a >= b."""
        half = _half_second(a, b, self.e, self.r)
        return self.across * half + self.excess * self.along[a] * self.along[b]


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
