"""The reduced energy U of a proof in balls, numbers with an error bound; its Taylor expansion.

    U = ½ Θ'QΘ + q'Θ + Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3),    t = [1, cos θ, sin θ, cos 2θ, ...]

Springs and ligaments add functions of the lengths of their lines (`lengths/lines.py`); ligaments of
a body that is not held add their least energy over its position (`lengths/free_ligaments.py`).
Guards add functions of θ2 (`guards.py`). That of a barrier, ½ k tan² θ2, is infinite at ±π/2; all
its derivatives by θ2 are monotonic functions of |θ2|, so balls need only the ends of an interval.
Where the slope of a guard jumps in a box, it may have all values between.

A ball (python-flint's `arb`) is a number with a bound on its error. Each result contains the exact
value for every U whose numbers round to the stored doubles.
"""

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES, Box
from rbstab.analysis.proof_check.guards import SwitchingGuard, barrier, switching_guards
from rbstab.analysis.proof_check.lengths.free_ligaments import FreeLigaments
from rbstab.analysis.proof_check.lengths.ligaments import LigamentLaw
from rbstab.analysis.proof_check.lengths.lines import Ligament, Line
from rbstab.analysis.proof_check.slopes import largest_slope
from rbstab.analysis.proof_check.trigonometric import (
    Axes,
    Ball,
    TrigonometricSum,
    axes_of,
    rounded,
    square,
)

MOST_MULTIPLES = 4
"""The largest multiple of an angle in U. A proof has 2: U is quadratic in the rotation matrix."""

MOST_EVALUATIONS = 3_000_000
"""So often U is evaluated at most; this takes five to ten minutes. A line counts as two."""

MOST_LINES = 100

MOST_GUARDS = 20


class TooLongError(Exception):
    """The check takes too long."""


def symmetric(radius: float) -> Ball:
    """Return the ball about 0 with a radius, rounded up."""
    return arb(0, math.nextafter(radius, math.inf))


class Energy:
    """U with all its derivatives up to order 3.

    Args:
        data: `reduced_energy` of a proof: quadratic, linear and coefficients, and perhaps barrier,
            soft guards, a stop, lines and ligaments.

    Attributes:
        stiffness: k of a barrier on θ2, a ball; None without one.
        guards: The soft guards and the stop.
        springs: The springs whose lengths are in U.
        lines: The same, and the ligaments of a held body.
        position: The ligaments of a body that is not held; None without one.

    Raises:
        ValueError: Q is not symmetric, U has large multiples of an angle, k is not positive, a
            guard acts outwards, or there are too many lines or guards.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        Q = data["quadratic"]
        if any(Q[i][j] != Q[j][i] for i in AXES for j in AXES):
            raise ValueError("The quadratic part of the reduced energy is not symmetric")
        if len(data["coefficients"]) > 2 * MOST_MULTIPLES + 1:
            most = f"more than {MOST_MULTIPLES} times an angle"
            raise ValueError(f"The reduced energy has {most} in a sine or cosine")
        stiffness = data.get("barrier")
        if stiffness is not None and not stiffness > 0:
            raise ValueError("The barrier has a stiffness that is not positive")
        self.stiffness = None if stiffness is None else rounded(stiffness)
        self.guards = switching_guards(data)
        if len(self.guards) > MOST_GUARDS:
            raise ValueError(f"The reduced energy has more than {MOST_GUARDS} guards")
        self.quadratic = [[rounded(entry) for entry in row] for row in Q]
        self.linear = [rounded(entry) for entry in data["linear"]]
        springs, ligaments = (data.get(key) or () for key in ("lines", "ligaments"))
        if len(springs) + len(ligaments) > MOST_LINES:
            raise ValueError(f"The reduced energy has more than {MOST_LINES} lines")
        self.periodic = TrigonometricSum(data["coefficients"])
        self.springs = [Line(one) for one in springs]
        self.lines: list[Line | Ligament] = [*self.springs, *(Ligament(one) for one in ligaments)]
        free = data.get("free_ligaments")
        self.position = None if free is None else FreeLigaments(free)
        self.evaluations = 0

    @property
    def stop(self) -> SwitchingGuard | None:
        """The stop; None without one."""
        return next((one for one in self.guards if one.couple is None), None)

    @property
    def laws(self) -> list[LigamentLaw]:
        """The laws of all ligaments."""
        held = [line.law for line in self.lines if isinstance(line, Ligament)]
        free = [] if self.position is None else [one.law for one in self.position.ligaments]
        return held + free

    def derivatives(self, Theta: Sequence[Ball]) -> dict[tuple[int, ...], Ball]:
        """Return the derivatives at a ball of Θ by their axes, in rising order: (0, 0, 2), ...

        Those of `position` and `guards` are not among them.

        Raises:
            TooLongError: U was evaluated too often.
        """
        return self.with_barrier(self.smooth(Theta), Theta[1])

    def with_barrier(self, found: Mapping[Axes, Ball], angle: Ball) -> dict[Axes, Ball]:
        """Add the derivatives of the barrier at a ball of θ2 to those of all the rest."""
        total = dict(found)
        if self.stiffness is not None:
            for order, term in enumerate(barrier(self.stiffness, angle)):
                total[(1,) * order] += term
        return total

    def smooth(self, Theta: Sequence[Ball]) -> dict[Axes, Ball]:
        """Return the derivatives of U without its barrier, as `derivatives` does.

        Raises:
            TooLongError: U was evaluated too often.
        """
        self._count()
        found = self.periodic.derivatives(Theta)
        slopes = [sum((row[j] * Theta[j] for j in AXES), arb(0)) for row in self.quadratic]
        for i in AXES:
            found[()] += (slopes[i] / 2 + self.linear[i]) * Theta[i]
            found[i,] += slopes[i] + self.linear[i]
            for j in range(i, 3):
                found[i, j] += self.quadratic[i][j]
        return self._with_lines(found, Theta)

    def _with_lines(self, found: dict[Axes, Ball], Theta: Sequence[Ball]) -> dict[Axes, Ball]:
        """Add the lines to derivatives at a ball of Θ."""
        for line in self.lines:
            for axes, value in line.derivatives(Theta).items():
                found[axes] += value
        return found

    def _count(self) -> None:
        """Count one more evaluation of U."""
        self.evaluations += (
            1 + 2 * len(self.lines) + (0 if self.position is None else self.position.cost)
        )
        if self.evaluations > MOST_EVALUATIONS:
            raise TooLongError(f"The check needs more than {MOST_EVALUATIONS:,} evaluations of U")

    def end_before_barrier(self, first: Ball, third: Ball) -> float | None:
        """Return an angle from which on, up to π/2, U rises with |θ2|; None if none is found.

        For |θ1| <= first and |θ3| <= third, the slope of all but the barrier is at most b. The
        slope k tan θ2 / cos² θ2 of the barrier grows with θ2, and exceeds k tan³ θ2.
        """
        reach, k = [first, arb.pi() / 2, third], self.stiffness
        turned = sum((abs(self.quadratic[1][j]) * reach[j] for j in AXES), arb(0))
        b = (turned + abs(self.linear[1]) + self._steepest(1)).abs_upper()
        angle = float(((1 + b / k).root(3)).atan()) + 1e-9
        # A double beyond π/2 has no bounds, and no comparison with them is true.
        return angle if barrier(k, arb(angle))[1] > b else None

    def confined(self, first: Ball, third: Ball) -> bool:
        """Return whether all rest states with |θ2| <= π/2 have |θ1| < first and |θ3| < third.

        Bounds on single terms are tried before a search for the largest slopes, which takes long.
        """
        for slope in (self._steepest, self._sharper):
            bound = self.confinement(slope)
            if bound is not None and bool(bound[0] < first) and bool(bound[1] < third):
                return True
        return False

    def confinement(self, slope: Callable[[int], Ball] | None = None) -> list[Ball] | None:
        """Bound |θ1| and |θ3| at all rest states with |θ2| <= π/2; None if k is not definite.

        k [θ1, θ3]' = -[q1 + K12 θ2 + ∂p/∂θ1, q3 + K32 θ2 + ∂p/∂θ3]' with the periodic part p.

        Args:
            slope: Bounds |∂p/∂θ| along an axis; by default as sharp as can be.
        """
        slope = slope or self._sharper
        Q = self.quadratic
        k = arb_mat([[Q[i][j] for j in (0, 2)] for i in (0, 2)])
        if not (k[0, 0] > 0 and k.det() > 0):
            return None
        inverse = k.inv()
        load = [abs(self.linear[j]) + abs(Q[j][1]) * arb.pi() / 2 + slope(j) for j in (0, 2)]
        return [sum((abs(inverse[i, j]) * load[j] for j in (0, 1)), arb(0)) for i in (0, 1)]

    def _steepest(self, axis: int) -> Ball:
        """Bound |∂p/∂θ| along an axis, with the periodic part p, lines included."""
        free = arb(0) if self.position is None else self.position.steepest(axis)
        lines = sum((line.steepest(axis) for line in self.lines), free)
        return lines + self.periodic.steepest(axis)

    def _sharper(self, axis: int) -> Ball:
        """Bound |∂p/∂θ| for |θ2| <= π/2: with lines, the bounds of single terms are too large."""
        single = self._steepest(axis)
        if not self.lines and self.position is None:
            return single
        periodic = copy.copy(self)
        periodic.stiffness, periodic.guards = None, []
        periodic.quadratic = [[arb(0)] * 3 for _ in AXES]
        periodic.linear = [arb(0)] * 3

        def slope(box: Box) -> tuple[Ball, Ball]:
            taylor = Taylor(periodic, box)
            return taylor.gradient[axis, 0], taylor.whole_gradient[axis, 0].abs_upper()

        found = largest_slope(slope)
        self.evaluations = periodic.evaluations
        return single if found is None or not found < single else found


class Taylor:
    """U over a box, expanded about its centre m up to third order, with δ = Θ - m.

    With guards, bare is the expansion without them, and `added` has bounds on their energy and
    slope over the box. The gradient has all slopes of a guard that jumps in the box; no number at a
    stop, without which `inside` is. With a jump, below is the expansion with a line in place of the
    energy of what jumps, nowhere above it.
    value, gradient (3x1) and hessian (3x3) are those at m. change is the 3x3 matrix Tδ, with the
    third derivatives T over the whole box. With free ligaments, the Hessian of their energy is that
    over the whole box. So, for all Θ in the box,

        U = value + gradient'δ + ½ δ'(hessian + Tδ/3)δ
        ∇U = gradient + (hessian + Tδ/2)δ               H = hessian + Tδ.

    Args:
        U: The energy.
        box: The box.
        face: An axis and its exact value, a ball. The box is then flat along this axis.
        without: A guard to leave out.
    """

    def __init__(
        self,
        U: Energy,
        box: Box,
        face: tuple[int, Ball] | None = None,
        without: SwitchingGuard | None = None,
    ) -> None:
        middle = [low / 2 + high / 2 for low, high in box]
        centre = [arb(point) for point in middle]
        step = [symmetric(max(b - m, m - a)) for m, (a, b) in zip(middle, box, strict=True)]
        whole = [point + ball for point, ball in zip(centre, step, strict=True)]
        self.free = [axis for axis in AXES if face is None or axis != face[0]]
        if face is not None:
            axis, value = face
            centre[axis], whole[axis], step[axis] = value, value, arb(0)
        self.centre, self.step = centre, arb_mat([[entry] for entry in step])
        at_centre, third = U.smooth(centre), U.smooth(whole)
        self.ligaments = None if U.position is None else U.position.over(centre, step)
        self._expand(at_centre, third)
        self.bare: Taylor | None = None
        self.below: Taylor | None = None
        self.inside: Taylor | None = None
        guards = [one for one in U.guards if one is not without]
        if U.stiffness is None and not guards:
            return
        self.bare, self.added = copy.copy(self), (arb(0), arb(0))
        if U.stiffness is not None:
            energy, slope, *_ = barrier(U.stiffness, whole[1])
            self.added = (energy, slope)
            at_centre = U.with_barrier(at_centre, centre[1])
            self._expand(at_centre, U.with_barrier(third, whole[1]))
        jumping = [one for one in guards if one.jumps(whole[1])]
        for one in guards:
            if one not in jumping:
                self._add(one, whole[1], centre[1])
        if jumping:
            self.below = copy.copy(self)
            self.below.gradient, self.below.bare = arb_mat(self.gradient), None
            for one in jumping:
                self.below._add_line(one, whole[1])
                self._add(one, whole[1], centre[1])

    def _expand(self, at_centre: Mapping[Axes, Ball], third: Mapping[Axes, Ball]) -> None:
        """Set the terms of the expansion."""
        step = self.step.entries()
        self.value = at_centre[()]
        self.gradient = arb_mat([[at_centre[i,]] for i in AXES])
        self.hessian = arb_mat([[at_centre[min(i, j), max(i, j)] for j in AXES] for i in AXES])
        self.change = arb_mat(
            [
                [sum((third[axes_of(i, j, k)] * step[k] for k in AXES), arb(0)) for j in AXES]
                for i in AXES
            ]
        )
        if self.ligaments is not None:
            self.value += self.ligaments.value
            self.gradient += arb_mat([[entry] for entry in self.ligaments.gradient])
            self.hessian += self.ligaments.hessian

    def _add(self, guard: SwitchingGuard, whole: Ball, centre: Ball) -> None:
        """Add a guard for a ball of θ2 and its centre."""
        self.value += guard.energy(centre)
        if guard.couple is None:
            # A stop: any slope outwards from 0 on. Inside it adds nothing.
            if guard.touched(whole):
                self.inside = copy.copy(self)
                self._raise(arb("nan"), arb(0))
                self.added = (self.added[0], arb("nan"))
            return
        slope = guard.slope(whole if guard.jumps(whole) else centre)
        self._raise(slope, guard.curvature(whole))
        self.added = (self.added[0] + guard.energy(whole), self.added[1] + guard.slope(whole))

    def _add_line(self, guard: SwitchingGuard, whole: Ball) -> None:
        """Add a line through the angle of a guard that is nowhere above its energy.

        Its slope is one of those at the angle, and balances that of all else if it can.
        """
        side = 1 if whole > 0 else -1 if whole < 0 else 0
        pressing = (-side * self.gradient[1, 0]).mid()
        if side == 0 or not pressing > 0:
            return
        if guard.couple is not None and not pressing < guard.couple:
            pressing = arb(guard.couple.lower())
        self.value += pressing * (side * self.centre[1] - guard.angle)
        self._raise(side * pressing, arb(0))

    def _raise(self, slope: Ball, curvature: Ball) -> None:
        """Add to the derivatives of order 1 and 2 by θ2."""
        gradient, hessian = arb_mat(self.gradient), arb_mat(self.hessian)
        gradient[1, 0] += slope
        hessian[1, 1] += curvature
        self.gradient, self.hessian = gradient, hessian

    @property
    def whole_hessian(self) -> Any:
        """The Hessian over the box; no numbers where the slope of a guard jumps in it."""
        found = self.hessian + self.change
        if self.below is not None:
            found[1, 1] = arb("nan")
        return found

    @property
    def whole_gradient(self) -> Any:
        """The gradient over the box."""
        found = self.gradient + self.slope * self.step
        if self.bare is not None:
            along = self.bare.whole_gradient[1, 0] + self.added[1]
            found[1, 0] = found[1, 0] if along.contains(0) else along
        if self.inside is not None:
            # A stop pushes inwards: it balances nothing that does so too.
            rest, centre = self.inside.whole_gradient[1, 0], self.centre[1]
            balanced = not (rest > 0 and centre > 0) and not (rest < 0 and centre < 0)
            found[1, 0] = arb("nan") if balanced else rest
        return found

    @property
    def slope(self) -> Any:
        """The matrix S with ∇U = gradient + Sδ over the box."""
        return self.hessian + self.change / 2

    @property
    def inverse(self) -> Any:
        """A matrix Y near the inverse of the Hessian at m; None if there is none."""
        try:
            inverse = self.hessian.mid().inv().mid()
        except ZeroDivisionError:
            return None
        return inverse if all(entry.is_finite() for entry in inverse.entries()) else None

    def stays_above(self, bound: Ball) -> bool:
        """Return whether U >= bound is proved for all of the box."""
        if bool(self.values >= bound) or bool(self._by_squares() >= bound):
            return True
        return self.below is not None and self.below.stays_above(bound)

    @property
    def values(self) -> Ball:
        """A ball with all values of U over the box: the sum of its terms, with δ_i² >= 0."""
        total = self._sum_of_terms()
        if self.bare is None:
            return total
        apart = self.bare.values + self.added[0]
        return total if total.rad() < apart.rad() else apart

    def _sum_of_terms(self) -> Ball:
        d, bent = self.step, self.hessian + self.change / 3
        total = self.value
        for i in AXES:
            total += self.gradient[i, 0] * d[i, 0]
            total += bent[i, i] * square(d[i, 0].abs_upper()) * arb(0.25, 0.25)
            total += sum((bent[i, j] * d[i, 0] * d[j, 0] for j in range(i + 1, 3)), arb(0))
        return total

    def _by_squares(self) -> Ball:
        """Bound U by its unbounded minimum: gradient'δ + ½ δ'Hδ >= -½ gradient'H⁻¹gradient."""
        H = arb_mat([[self.hessian[i, j] for j in self.free] for i in self.free])
        g = arb_mat([[self.gradient[i, 0]] for i in self.free])
        size = len(self.free)
        leading = (arb_mat([[H[i, j] for j in range(n)] for i in range(n)]) for n in range(1, size))
        if not all(minor.det() > 0 for minor in [*leading, H]):
            return arb("nan")
        try:
            fall = g.transpose() * H.inv() * g / 2
        except ZeroDivisionError:
            return arb("nan")
        cubic = self.step.transpose() * self.change * self.step / 6
        return self.value - fall[0, 0] + cubic[0, 0]
