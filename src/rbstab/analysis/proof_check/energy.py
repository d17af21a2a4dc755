"""The reduced energy U of a proof in balls, numbers with an error bound.

    U = ½ Θ'QΘ + q'Θ + Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3),    t = [1, cos θ, sin θ, cos 2θ, ...]

Springs and ligaments add functions of the lengths of their lines (`lengths/lines.py`); ligaments of
a body that is not held add their least energy over its position (`lengths/free_ligaments.py`).
Elements of users add formulas (`formulas/formula.py`), parts max(h, 0), where their force jumps
(`formulas/kinks.py`), and least energies over own states (`formulas/own_states.py`).
Guards add functions of θ2 (`guards.py`). That of a barrier, ½ k tan² θ2, is infinite at ±π/2; all
its derivatives by θ2 are monotonic functions of |θ2|, so balls need only the ends of an interval.
Where the slope of a guard jumps in a box, it may have all values between.

A ball (python-flint's `arb`) is a number with a bound on its error. Each result contains the exact
value for every U whose numbers round to the stored doubles.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from flint import arb

from rbstab.analysis.proof_check.boxes import AXES
from rbstab.analysis.proof_check.formulas.formula import Formula
from rbstab.analysis.proof_check.formulas.kinks import kinks_of
from rbstab.analysis.proof_check.formulas.own_states import OwnStates
from rbstab.analysis.proof_check.guards import (
    Barrier,
    SwitchingGuard,
    barriers_of,
    switching_guards,
)
from rbstab.analysis.proof_check.lengths.free_ligaments import FreeLigaments
from rbstab.analysis.proof_check.lengths.ligaments import LigamentLaw
from rbstab.analysis.proof_check.lengths.lines import Ligament, Line
from rbstab.analysis.proof_check.trigonometric import Axes, Ball, TrigonometricSum, rounded

MOST_MULTIPLES = 4
"""The largest multiple of an angle in U. A proof has 2: U is quadratic in the rotation matrix."""

MOST_EVALUATIONS = 3_000_000
"""So often U is evaluated at most; this takes five to ten minutes. A line counts as two."""

OF_USERS = ("formulas", "kinks", "ridges", "own_states")
"""The parts of an energy that come from elements of users."""

MOST_LINES = 100

MOST_GUARDS = 20

MOST_STRETCH = 8.0


class TooLongError(Exception):
    """The check takes too long."""


class Energy:
    """U with all its derivatives up to order 3.

    Args:
        data: `reduced_energy` of a proof: quadratic, linear and coefficients, and perhaps barrier,
            soft guards, a stop, lines, ligaments, formulas, kinks, ridges and own states.

    Attributes:
        barriers: The barriers on single angles.
        guards: The soft guards and the stop.
        springs: The springs whose lengths are in U.
        lines: The same, and the ligaments of a held body.
        formulas: The energies of elements of users.
        kinks: Their parts max(h, 0) and min(h, 0), where their force jumps.
        own_states: Those of which the least energy over own states is in U.
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
        self.barriers = barriers_of(data)
        self.guards = switching_guards(data)
        if len(self.guards) > MOST_GUARDS:
            raise ValueError(f"The reduced energy has more than {MOST_GUARDS} guards")
        self.quadratic = [[rounded(entry) for entry in row] for row in Q]
        self.linear = [rounded(entry) for entry in data["linear"]]
        springs, ligaments = (data.get(key) or () for key in ("lines", "ligaments"))
        of_users = [one for key in OF_USERS for one in data.get(key) or ()]
        if len(springs) + len(ligaments) + len(of_users) > MOST_LINES:
            raise ValueError(f"The reduced energy has more than {MOST_LINES} lines")
        self.periodic = TrigonometricSum(data["coefficients"])
        self.springs = [Line(one) for one in springs]
        self.formulas = [Formula(one) for one in data.get("formulas") or ()]
        self.kinks = kinks_of(data)
        self.own_states = [OwnStates(one) for one in data.get("own_states") or ()]
        self.lines: list[Line | Ligament] = [*self.springs, *(Ligament(one) for one in ligaments)]
        free = data.get("free_ligaments")
        self.position = None if free is None else FreeLigaments(free)
        self.evaluations = 0

    @property
    def stop(self) -> SwitchingGuard | None:
        """The stop; None without one."""
        return next((one for one in self.guards if one.couple is None), None)

    @property
    def stretch(self) -> float:
        """How much thinner than wide boxes should be along θ2, where regions are checked.

        The energy of a stiff guard is so curved that wider boxes tell nothing. This only saves
        time: any number is right.
        """
        stiff = sum(float(one.stiffness) for one in self.guards)
        others = float(abs(self.quadratic[1][1]) + self.periodic.steepest(1))
        return min(MOST_STRETCH, max(1.0, math.sqrt(stiff / others))) if others > 0 else 1.0

    @property
    def laws(self) -> list[LigamentLaw]:
        """The laws of all ligaments."""
        held = [line.law for line in self.lines if isinstance(line, Ligament)]
        free = [] if self.position is None else [one.law for one in self.position.ligaments]
        return held + free

    def derivatives(self, Theta: Sequence[Ball]) -> dict[Axes, Ball]:
        """Return the derivatives at a ball of Θ by their axes, in rising order: (0, 0, 2), ...

        Those of `position`, `of_users` and `guards` are not among them.

        Raises:
            TooLongError: U was evaluated too often.
        """
        return self.with_barriers(self.smooth(Theta), Theta)

    def value(self, Theta: Sequence[Ball]) -> Ball:
        """Return U at a ball of Θ, without `position` and `guards`."""
        own_states = sum((one.value(Theta) for one in self.own_states), arb(0))
        return self.value_of_others(Theta) + own_states

    def value_of_others(self, Theta: Sequence[Ball]) -> Ball:
        """Return U at a ball of Θ without the least energies over own states."""
        formulas = sum((one.value(Theta) for one in (*self.formulas, *self.kinks)), arb(0))
        return self.derivatives(Theta)[()] + formulas

    @property
    def of_users(self) -> list[Formula | OwnStates]:
        """All parts that come from elements of users as formulas."""
        return [*self.formulas, *self.kinks, *self.own_states]

    def parts_over(self, centre: Sequence[Ball], step: Sequence[Ball]) -> list[Any]:
        """Return what `position`, `formulas` and `own_states` add over a box: centre + step.

        Each has a value and a gradient, those at the centre, and a Hessian over the whole box.
        """
        free = [] if self.position is None else [self.position]
        parts: list[Any] = [*free, *self.formulas, *self.own_states]
        return [part.over(centre, step) for part in parts]

    def with_barriers(self, found: Mapping[Axes, Ball], Theta: Sequence[Ball]) -> dict[Axes, Ball]:
        """Add the derivatives of the barriers at a ball of Θ to those of all the rest."""
        total = dict(found)
        for one in self.barriers:
            for order, term in enumerate(one.terms(Theta[one.axis])):
                total[(one.axis,) * order] += term
        return total

    def barrier_on(self, axis: int) -> Barrier | None:
        """Return the barrier on an angle; None without one."""
        return next((one for one in self.barriers if one.axis == axis), None)

    def smooth(self, Theta: Sequence[Ball]) -> dict[Axes, Ball]:
        """Return the derivatives of U without its barriers, as `derivatives` does.

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
        formulas = sum(one.cost for one in self.of_users)
        free = 0 if self.position is None else self.position.cost
        self.evaluations += 1 + 2 * len(self.lines) + formulas + free
        if self.evaluations > MOST_EVALUATIONS:
            raise TooLongError(f"The check needs more than {MOST_EVALUATIONS:,} evaluations of U")

    def end_before(self, barrier: Barrier, first: Ball, third: Ball) -> float | None:
        """Return an angle from which on, up to the end of a barrier, U rises with its angle's size.

        For |θ1| <= first and |θ3| <= third, the slope of all but the barrier is at most b, apart
        from soft guards, which rise too. None if no such angle is found.
        """
        reach, axis = [first, arb.pi() / 2, third], barrier.axis
        turned = sum((abs(self.quadratic[axis][j]) * reach[j] for j in AXES), arb(0))
        b = (turned + abs(self.linear[axis]) + self.steepest(axis)).abs_upper()
        return barrier.end_beyond(b)

    def steepest(self, axis: int) -> Ball:
        """Bound |∂p/∂θ| along an axis, with the periodic part p, lines included."""
        free = arb(0) if self.position is None else self.position.steepest(axis)
        parts = [*self.lines, *self.of_users]
        lines = sum((part.steepest(axis) for part in parts), free)
        return lines + self.periodic.steepest(axis)
