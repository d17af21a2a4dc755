"""The energy from which a stored proof follows, as plain data and as a form."""

import math
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from rbstab.experiment.stored_proof.entries import Coefficients, Entry, Triple

if TYPE_CHECKING:
    from rbstab.analysis.proof.guards.guard import Guard
    from rbstab.analysis.proof.guards.soft import SoftEnergy
    from rbstab.analysis.proof.ligaments.free import FreeLigament, FreeLigaments
    from rbstab.analysis.proof.ligaments.held import LigamentLine
    from rbstab.analysis.proof.ligaments.law import LigamentEnergy
    from rbstab.analysis.proof.lines.line import Line
    from rbstab.analysis.proof.traced.energy import TracedEnergy
    from rbstab.analysis.proof.traced.kinked import KinkedEnergy
    from rbstab.analysis.proof.traced.own_states import OwnStatesEnergy
    from rbstab.analysis.proof.trigonometric import TrigonometricForm


class ProvedLine(Entry):
    """The length of a line in an energy: w √s(Θ), J, with s = Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3), m².

    weight is w, N. Each number is the exact one rounded once.
    """

    weight: float
    coefficients: Coefficients

    @property
    def line(self) -> "Line":
        """The line, which can be evaluated with proved errors.

        Raises:
            NoLength: It may have no length.
        """
        from rbstab.analysis.proof.lines.shortest import line_of

        return line_of(self.weight, _periodic(self.coefficients))


class ProvedLaw(Entry):
    """The law of a ligament: stiffness is k, N, slack_length ℓ₀, m, and toe_strain ε_t.

    Each number is the exact one rounded once.
    """

    stiffness: PositiveFloat
    slack_length: PositiveFloat
    toe_strain: PositiveFloat

    @property
    def law(self) -> "LigamentEnergy":
        """The energy as a function of the length."""
        from rbstab.analysis.proof.ligaments.law import LigamentEnergy

        return LigamentEnergy(self.stiffness, self.slack_length, self.toe_strain)


class ProvedLigament(ProvedLaw):
    """The energy of a ligament of a held body, J; s = Σ C_abc t_a t_b t_c, m², is its length²."""

    coefficients: Coefficients

    @property
    def line(self) -> "LigamentLine":
        """The line, which can be evaluated with proved errors."""
        from rbstab.analysis.proof.ligaments.held import LigamentLine

        return LigamentLine(_periodic(self.coefficients), self.law)


class ProvedFreeLigament(ProvedLaw):
    """The energy of a ligament of a body that is not held, J: its length is |z + r(Θ)|.

    offset has the coefficients of the three entries of r, m.
    """

    offset: tuple[Coefficients, Coefficients, Coefficients]

    @property
    def ligament(self) -> "FreeLigament":
        """The ligament, whose length can be evaluated with proved errors."""
        from rbstab.analysis.proof.ligaments.free import FreeLigament

        first, second, third = (_periodic(entry) for entry in self.offset)
        return FreeLigament((first, second, third), self.law)


class ProvedPosition(Entry):
    """The least energy of ligaments over the position, J: ½ z'Sz and their energies.

    stiffness is S, N/m. Each number is the exact one rounded once.
    """

    stiffness: tuple[Triple, Triple, Triple]
    ligaments: tuple[ProvedFreeLigament, ...]

    @property
    def line(self) -> "FreeLigaments":
        """The energy, which can be evaluated with proved errors."""
        from rbstab.analysis.proof.ligaments.free import FreeLigaments

        found = tuple(one.ligament for one in self.ligaments)
        return FreeLigaments(np.array(self.stiffness), found)


def _periodic(coefficients: Coefficients) -> "TrigonometricForm":
    """Return a form without a quadratic part."""
    from rbstab.analysis.proof.trigonometric import TrigonometricForm

    return TrigonometricForm(np.zeros((3, 3)), np.zeros(3), np.array(coefficients))


class ProvedGuard(Entry):
    """The energy of soft guards of θ2 with one angle, J: K e + ½ k e² with e = (|θ2| - θ_s)₊.

    couple is K, N m, stiffness k, N m/rad, and soft_angle θ_s, rad. Each number is the exact one
    rounded once.
    """

    couple: NonNegativeFloat
    stiffness: NonNegativeFloat
    soft_angle: PositiveFloat

    @property
    def energy(self) -> "SoftEnergy":
        """The energy, which can be evaluated with proved errors."""
        from rbstab.analysis.proof.guards.soft import SoftEnergy

        return SoftEnergy(self.couple, self.stiffness, self.soft_angle)


class ProvedFormula(Entry):
    """The energy of an element of a user as a formula of Θ, J: its operations, one after the other.

    An operation is a list of its kind and its operands: ["theta", axis], ["constant", number], or
    a kind and the places of earlier operations, as in ["*", 0, 3] or ["sin", 2]. That of "**" are a
    place and a whole number. A constant stands for all numbers that round to it.
    """

    name: str
    operations: tuple[tuple[str | int | float, ...], ...]

    @model_validator(mode="after")
    def _check(self) -> Self:
        from rbstab.analysis.proof.formulas.program import check

        check(self.operations)
        return self

    @property
    def line(self) -> "TracedEnergy":
        """The energy, which can be evaluated with proved errors."""
        from rbstab.analysis.proof.formulas.program import Program
        from rbstab.analysis.proof.traced.energy import TracedEnergy

        return TracedEnergy(self.name, Program(self.operations))


class ProvedKink(ProvedFormula):
    """The part max(h(Θ), 0) of the energy of an element of a user, J, with the formula h."""

    _ridge: ClassVar[bool] = False

    @property
    def line(self) -> "KinkedEnergy":  # type: ignore[override]
        """The energy, which can be evaluated with proved errors."""
        from rbstab.analysis.proof.formulas.program import Program
        from rbstab.analysis.proof.traced.kinked import KinkedEnergy

        return KinkedEnergy(self.name, Program(self.operations), self._ridge)


class ProvedRidge(ProvedKink):
    """The part min(h(Θ), 0) of the energy of an element of a user, J, with the formula h."""

    _ridge: ClassVar[bool] = True


class ProvedOwnStates(Entry):
    """The energy of an element of a user that is convex in its own states, J, as `ProvedFormula`.

    U has its least value over them. There are `states` of them; the formula also has operations
    ["length", place]: one of them.
    """

    name: str
    states: PositiveInt
    operations: tuple[tuple[str | int | float, ...], ...]

    @model_validator(mode="after")
    def _check(self) -> Self:
        from rbstab.analysis.proof.formulas.program import check

        check(self.operations, lengths=self.states)
        return self

    @property
    def line(self) -> "OwnStatesEnergy":
        """The energy, which can be evaluated with proved errors."""
        from rbstab.analysis.proof.formulas.program import Program
        from rbstab.analysis.proof.traced.own_states import OwnStatesEnergy

        return OwnStatesEnergy(self.name, Program(self.operations), self.states)


class ProvedEnergy(Entry):
    """The reduced energy U of a proof, J: ½ Θ'QΘ + q'Θ + Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3).

    t is [1, cos θ, sin θ, cos 2θ, ...]. With a barrier on θ2, U has the term ½ k tan² θ2 too, and
    barrier is k, N m; None without one. With barriers on θ1 and θ3, it has ½ k tan²(θ/2) of both,
    and outer_barrier is their k. The energies of soft guards are added to U; a stop allows no |θ2|
    above the angle `stop`, rad. With springs, U has the lengths of their lines too; lines
    is None without one. The energies of ligaments are added to U: those of a held body, or their
    least value over the position. Elements of users add formulas, if their energies are not of the
    form above, and parts where their force jumps: max(h, 0) are kinks, and min(h, 0) ridges. Those
    that are convex in own states, and not quadratic, add their least energy over these: own_states.
    Each number is the exact one rounded once.
    """

    quadratic: tuple[Triple, Triple, Triple]
    linear: Triple
    coefficients: Coefficients
    barrier: PositiveFloat | None = None
    outer_barrier: PositiveFloat | None = None
    soft_guards: tuple[ProvedGuard, ...] | None = None
    stop: PositiveFloat | None = None
    lines: tuple[ProvedLine, ...] | None = None
    ligaments: tuple[ProvedLigament, ...] | None = None
    free_ligaments: ProvedPosition | None = None
    formulas: tuple[ProvedFormula, ...] | None = None
    kinks: tuple[ProvedKink, ...] | None = None
    ridges: tuple[ProvedRidge, ...] | None = None
    own_states: tuple[ProvedOwnStates, ...] | None = None

    @property
    def form(self) -> "TrigonometricForm":
        """U as a form that can be evaluated with proved errors."""
        from rbstab.analysis.proof.trigonometric import TrigonometricForm

        quadratic, linear = np.array(self.quadratic), np.array(self.linear)
        free = () if self.free_ligaments is None else (self.free_ligaments,)
        jumping = (*(self.kinks or ()), *(self.ridges or ()))
        of_users = (*(self.formulas or ()), *jumping, *(self.own_states or ()))
        parts = (*(self.lines or ()), *of_users, *(self.ligaments or ()), *free)
        lines = tuple(one.line for one in parts)
        C = np.array(self.coefficients)
        return TrigonometricForm(quadratic, linear, C, guard=self._guard, lines=lines)

    @property
    def _guard(self) -> "Guard | None":
        from rbstab.analysis.proof.guards.barrier import BarrierEnergy
        from rbstab.analysis.proof.guards.guard import Guard
        from rbstab.analysis.proof.guards.soft import SoftEnergy

        barrier = None if self.barrier is None else BarrierEnergy(self.barrier)
        soft = [one.energy for one in self.soft_guards or ()]
        if self.stop is not None:
            soft.append(SoftEnergy(math.inf, 0.0, self.stop))
        outer = None if self.outer_barrier is None else BarrierEnergy(self.outer_barrier, half=True)
        acts = barrier is not None or soft or outer is not None
        return Guard(barrier, tuple(soft), outer) if acts else None


class ProvedFreeLine(Entry):
    """The length of a line in an energy of Θ and z: w |z + r(Θ)|, J.

    weight is w, N. offset has the coefficients of the three entries of r, m, as those of
    `ProvedEnergy`. Each number is the exact one rounded once.
    """

    weight: float
    offset: tuple[Coefficients, Coefficients, Coefficients]


class ProvedFreeFormula(Entry):
    """The energy of an element of a user as a formula of Θ and X, J, as `ProvedFormula` has it.

    It also has operations ["length", place]: an entry of X.
    """

    name: str
    operations: tuple[tuple[str | int | float, ...], ...]

    @model_validator(mode="after")
    def _check(self) -> Self:
        from rbstab.analysis.proof.formulas.program import check

        check(self.operations, lengths=3)
        return self


class ProvedTiedEnergy(Entry):
    """The energy W of a proof for a tied body in six variables, J.

    W = U(Θ) + ½ z'Sz + Σ w_j |z + r_j(Θ)|, where z is X minus its value without what follows. U is
    ½ Θ'QΘ + q'Θ + Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3), and stiffness is S, N/m. Guards add to U what
    they add to that of `ProvedEnergy`. lines are those of springs. The energies of ligaments are
    added to W, and the formulas of elements of users; then position has the coefficients of X*(Θ),
    m, and X = X* + z. Each number is the exact one rounded once.
    """

    quadratic: tuple[Triple, Triple, Triple]
    linear: Triple
    coefficients: Coefficients
    stiffness: tuple[Triple, Triple, Triple]
    lines: tuple[ProvedFreeLine, ...]
    barrier: PositiveFloat | None = None
    outer_barrier: PositiveFloat | None = None
    soft_guards: tuple[ProvedGuard, ...] | None = None
    ligaments: tuple[ProvedFreeLigament, ...] | None = None
    position: tuple[Coefficients, Coefficients, Coefficients] | None = None
    formulas: tuple[ProvedFreeFormula, ...] | None = None
