"""The energy from which a stored proof follows, as plain data and as a form."""

from typing import TYPE_CHECKING

import numpy as np
from pydantic import PositiveFloat

from rbstab.experiment.stored_proof.entries import Coefficients, Entry, Triple

if TYPE_CHECKING:
    from rbstab.analysis.proof.lines.line import Line
    from rbstab.analysis.proof.tied.energy import TiedEnergy
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
        from rbstab.analysis.proof.trigonometric import TrigonometricForm

        C = np.array(self.coefficients)
        return line_of(self.weight, TrigonometricForm(np.zeros((3, 3)), np.zeros(3), C))


class ProvedEnergy(Entry):
    """The reduced energy U of a proof, J: ½ Θ'QΘ + q'Θ + Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3).

    t is [1, cos θ, sin θ, cos 2θ, ...]. With a barrier on θ2, U has the term ½ k tan² θ2 too, and
    barrier is k, N m; None without one. With springs, U has the lengths of their lines too; lines
    is None without one. Each number is the exact one rounded once.
    """

    quadratic: tuple[Triple, Triple, Triple]
    linear: Triple
    coefficients: Coefficients
    barrier: PositiveFloat | None = None
    lines: tuple[ProvedLine, ...] | None = None

    @property
    def form(self) -> "TrigonometricForm":
        """U as a form that can be evaluated with proved errors."""
        from rbstab.analysis.proof.guard import Guard
        from rbstab.analysis.proof.trigonometric import TrigonometricForm

        quadratic, linear = np.array(self.quadratic), np.array(self.linear)
        guard = None if self.barrier is None else Guard(self.barrier)
        lines = tuple(one.line for one in self.lines or ())
        C = np.array(self.coefficients)
        return TrigonometricForm(quadratic, linear, C, guard=guard, lines=lines)


class ProvedFreeLine(Entry):
    """The length of a line in an energy of Θ and z: w |z + r(Θ)|, J.

    weight is w, N. offset has the coefficients of the three entries of r, m, as those of
    `ProvedEnergy`. Each number is the exact one rounded once.
    """

    weight: float
    offset: tuple[Coefficients, Coefficients, Coefficients]


class ProvedTiedEnergy(Entry):
    """The energy W of a proof for a tied body with springs, J: U(Θ) + ½ z'Sz + Σ w_j |z + r_j(Θ)|.

    z is X minus its value without lines. U is ½ Θ'QΘ + q'Θ + Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3), and
    stiffness is S, N/m. With a barrier on θ2, U has the term ½ k tan² θ2 too, and barrier is k,
    N m; None without one. Each number is the exact one rounded once.
    """

    quadratic: tuple[Triple, Triple, Triple]
    linear: Triple
    coefficients: Coefficients
    stiffness: tuple[Triple, Triple, Triple]
    lines: tuple[ProvedFreeLine, ...]
    barrier: PositiveFloat | None = None


def energy_of(form: "TrigonometricForm") -> ProvedEnergy:
    """Return a reduced energy as plain data."""
    return ProvedEnergy(
        quadratic=form.quadratic.tolist(),
        linear=form.linear.tolist(),
        coefficients=form.coefficients.tolist(),
        barrier=None if form.guard is None else form.guard.stiffness,
        lines=tuple(
            ProvedLine(weight=line.weight, coefficients=line.square.coefficients.tolist())
            for line in form.lines
        )
        or None,
    )


def tied_energy_of(energy: "TiedEnergy") -> ProvedTiedEnergy:
    """Return an energy of Θ and z as plain data."""
    return ProvedTiedEnergy(
        quadratic=energy.form.quadratic.tolist(),
        linear=energy.form.linear.tolist(),
        coefficients=energy.form.coefficients.tolist(),
        stiffness=energy.stiffness.tolist(),
        barrier=None if energy.form.guard is None else energy.form.guard.stiffness,
        lines=tuple(
            ProvedFreeLine(
                weight=line.weight, offset=tuple(one.coefficients.tolist() for one in line.offset)
            )
            for line in energy.lines
        ),
    )
