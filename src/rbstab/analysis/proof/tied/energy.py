"""The stored energy of a tied body in six variables, as a function of Θ and of a shift z.

Without its nonlinear parts the stored energy is quadratic in x = [X, D], with the minimizer x*(Θ).
Let z = X - X*(Θ). With the least energy over D,

    W(Θ, z) = U(Θ) + ½ z'Sz + Σ w_j |e_j| + Σ G_j(|e_j|²) + Σ f_j(Θ, X)    e_j = z + r_j(Θ)

where U is a form, perhaps with guards, S is constant and positive definite, e_j is the
line of a spring or of a ligament, G_j the energy of a ligament, and f_j that of an element of a
user, which is convex in X.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.proof.ligaments.free import FreeLigament
from rbstab.analysis.proof.lines.separate import lengths_apart
from rbstab.analysis.proof.multiple_angles import NotTrigonometric, form_of
from rbstab.analysis.proof.polynomial import Ring
from rbstab.analysis.proof.reduced_energy import (
    ExactSystem,
    NoEnergyReason,
    NoReducedEnergy,
    StoredEnergy,
    eliminated,
    inverse_stiffness,
    reject_unsmooth,
    stored_energy,
)
from rbstab.analysis.proof.tied.formula import FreeFormula
from rbstab.analysis.proof.tied.position import offset, periodic, position_spring
from rbstab.analysis.proof.traced.separate import (
    NotInProofsError,
    entries_without_users,
    user_energies,
    without_users,
)
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

KINKED = "its force jumps, and no proof in six variables takes such a force into account"


@dataclass(frozen=True, eq=False)
class FreeLine:
    """The energy w |e| of a line with e = z + r(Θ), J.

    Args:
        weight: w, N, an exact number rounded once.
        offset: The three entries of r, m.
    """

    weight: float
    offset: tuple[TrigonometricForm, ...]


@dataclass(frozen=True, eq=False)
class TiedEnergy:
    """W(Θ, z), J; each number is exact and rounded once.

    Args:
        form: U.
        stiffness: S, shape (3, 3), N/m.
        compliance: S⁻¹, shape (3, 3), m/N.
        lines: The lines of springs, with w < 0. A spring without a rest length has none: w is 0.
        minimizer: The entries of x*(Θ).
        own: H_DD⁻¹H_DX, shape (own states, 3): D = D* minus this times z.
        configurations: The configurations of the system.
        ligaments: The ligaments.
        formulas: The energies f of elements of users.
    """

    form: TrigonometricForm
    stiffness: Array
    compliance: Array
    lines: tuple[FreeLine, ...]
    minimizer: tuple[TrigonometricForm, ...]
    own: Array
    configurations: Configurations
    ligaments: tuple[FreeLigament, ...] = ()
    formulas: tuple[FreeFormula, ...] = ()

    @property
    def position(self) -> tuple[TrigonometricForm, ...]:
        """The entries of X*(Θ), if a formula needs them."""
        return self.minimizer[:3] if self.formulas else ()

    def configuration(self, Theta: Array, z: Array) -> Array:
        """Return q = [Θ, X, D] with the least energy over D, shape (size,)."""
        x = np.array([form.value(Theta[np.newaxis])[0] for form in self.minimizer])
        return np.concatenate([Theta, x[:3] + z, x[3:] - self.own @ z])


def tied_energy(system: System, exact_system: ExactSystem) -> TiedEnergy:
    """Compute W from the stored energies of the elements, exactly.

    Args:
        system: The system, in doubles.
        exact_system: As for `reduced_energy`.

    Raises:
        NoReducedEnergy: The energy has another form.
    """
    reject_unsmooth(system)
    at_rest = configurations(system)
    if at_rest.held:
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC)
    try:
        users = user_energies(at_rest)
        if users.kinked:
            raise NotInProofsError(f"{users.kinked[0].name}: {KINKED}")
        ring = Ring(3, at_rest.size - 3, roots=len(system.elements), roots_of_lengths=True)
        exact = without_users(configurations(exact_system(ring.decimals)).system)
        parts = stored_energy(exact, ring, users, entries_without_users(at_rest))
        if not parts.energy.known:
            raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC)
        if parts.guard is not None and parts.guard.stop is not None:
            raise NoReducedEnergy(NoEnergyReason.STOP_IN_SIX)
        formulas = [(one.name, one.program) for one in users.traced]
        formulas += [(one.name, one.program) for one in users.of_position]
        free = tuple(FreeFormula(*one) for one in formulas)
        return _tied(at_rest, parts, free)
    except NotInProofsError as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_IN_PROOFS, str(error)) from error
    except NotTrigonometric as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC) from error
    except OverflowError as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_FINITE) from error


def tied_energy_of_doubles(system: System) -> TiedEnergy:
    """Return W with the doubles of a system as exact numbers."""

    def exact(convert: Any) -> System:
        return map_parameters(configurations(system).system, lambda _, value: convert(value))

    return tied_energy(system, exact)


def _tied(
    at_rest: Configurations, parts: StoredEnergy, formulas: tuple[FreeFormula, ...]
) -> TiedEnergy:
    """Return W of a stored energy."""
    plain, weights = lengths_apart(parts.energy)
    reduced, minimizer = eliminated(plain)
    spring = position_spring(inverse_stiffness(plain))
    if any(weight > 0 for weight in weights):
        # A line that pulls at any length could be at rest without a length.
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC)
    pairs = zip(weights, parts.energy.ring.squares, strict=True)
    forms = tuple(form_of(entry) for entry in minimizer)
    return TiedEnergy(
        replace(form_of(reduced), guard=parts.guard),
        spring.stiffness,
        spring.compliance,
        tuple(
            FreeLine(float(weight), offset(square, minimizer))
            for weight, square in pairs
            if weight != 0
        ),
        (*(periodic(entry) for entry in minimizer[:3]), *forms[3:]) if formulas else forms,
        spring.own,
        at_rest,
        tuple(FreeLigament(offset(square, minimizer), law) for square, law in parts.ligaments),
        formulas,
    )
