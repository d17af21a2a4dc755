"""The energy from which a stored proof follows, as plain data and as a form."""

from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np
from pydantic import (
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    model_validator,
)

from rbstab.experiment.stored_proof.entries import Coefficients, Entry, Triple

if TYPE_CHECKING:
    from rbstab.analysis.proof.guards.soft import SoftEnergy
    from rbstab.analysis.proof.ligaments.free import FreeLigament
    from rbstab.analysis.proof.ligaments.law import LigamentEnergy
    from rbstab.analysis.proof.trigonometric import TrigonometricForm
    from rbstab.proof.model import Energy


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


class ProvedEnergy(Entry):
    """The potential energy U of a proof, J, as exact operations (`rbstab.proof.record`).

    operations are carried out one after the other on the results of earlier ones; the last one is
    U. digest is that of the expression. U depends on Θ, the variables 0 to 2, and on those in
    `free`, over which it has its least value. stop is the largest |θ2| that a stop allows, rad, as
    a rational number. Of the angles in `closed` no motion reaches the end of the range.
    """

    operations: tuple[tuple[str | int, ...], ...]
    digest: str
    free: tuple[PositiveInt, ...] = ()
    stop: str | None = None
    closed: tuple[NonNegativeInt, ...] = ()

    @cached_property
    def energy(self) -> "Energy":
        """U as an exact expression.

        Raises:
            WrongRecordError: The operations describe none, or not the one with this digest.
        """
        from rbstab.proof.record import read_energy

        return read_energy(self.model_dump())


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
