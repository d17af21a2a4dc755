"""The reduced potential energy: the stored energy at an attitude, minimized over all else."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.proof.guard import Guard, exact_number, separated
from rbstab.analysis.proof.lines.separate import lengths_apart, separated_lines
from rbstab.analysis.proof.lines.shortest import NoLength
from rbstab.analysis.proof.multiple_angles import NotTrigonometric, form_of
from rbstab.analysis.proof.polynomial import Polynomial, Ring, fraction
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.elements.guards.barrier import Barrier
from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.spring import Spring
from rbstab.mechanics.numbers import Array
from rbstab.systems.modes import has_modes
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

if TYPE_CHECKING:
    from flint import fmpq


class NoEnergyReason(Enum):
    """Why a system has no reduced potential energy; the value is the text to show."""

    NO_POTENTIAL = "the connector's force on the surface s = F + κE has no potential"
    NOT_SMOOTH = "the energy K_s|E| of the sliding connector has no gradient at E = 0"
    SWITCHES = "an element switches, so its energy is not one formula for all attitudes"
    SUPPLIES = "an input supplies power"
    USER_CODE = (
        "an element is code of a user, and no proof knows that it computes the same formula for "
        "all numbers"
    )
    NOT_HELD = "nothing holds the position: the energy has no single minimum over X and D"
    NOT_QUADRATIC = "the energy is not a quadratic function of X and D with constant stiffness"
    NOT_FINITE = "the energy is too large for double precision"
    NOT_TRIGONOMETRIC = (
        "the energy is not a quadratic function of Θ plus a polynomial in its sines and cosines"
    )
    WEAK_BARRIER = "the barrier on θ2 is too weak: it acts only where doubles do not tell π/2 apart"
    NO_LENGTH = (
        "the line of a spring may have no length at some attitude, and then its force no direction"
    )
    FREE_LINES = "the body is not held, so the length of a spring depends on X"
    LINES_OF_BODIES = "no proof for all bodies within tolerances takes a spring into account"
    BARRIER_OF_BODIES = "no proof for all bodies within tolerances takes a barrier into account"
    OUTER_BARRIER = "no proof takes a guard of θ1 and θ3 (outer_stiffness) into account"


ExactSystem = Callable[[Callable[[Array], Array]], System]
"""A function that builds a system in a kind of number, given the conversion of its doubles."""


class NoReducedEnergy(Exception):
    """A system has no reduced potential energy; `reason` names the reason."""

    def __init__(self, reason: NoEnergyReason) -> None:
        super().__init__(reason.value)
        self.reason = reason


@dataclass(frozen=True, eq=False)
class ReducedEnergy:
    """U(Θ) = min over x of Π(Θ, x), with x = [X, D] (x = D if the contact point is held).

    Π, the stored energy, is quadratic in x, so x* = -H⁻¹b(Θ) and U = Π(Θ, 0) - ½ b'H⁻¹b. Zeros of
    ∂U/∂Θ and rest states correspond one to one.

    configurations are the system's configurations. form is U. minimizer has the entries of x*.
    The energy of a barrier is a function of θ2 alone: it is the guard of the form, and x* does not
    depend on it.
    """

    configurations: Configurations
    form: TrigonometricForm
    minimizer: tuple[TrigonometricForm, ...]

    def configuration(self, Theta: Array) -> Array:
        """Return q = [Θ, x*(Θ)], shape (size,)."""
        values = [form.value(Theta[np.newaxis])[0] for form in self.minimizer]
        return np.concatenate([Theta, values])


def reduced_energy(system: System, exact_system: ExactSystem | None = None) -> ReducedEnergy:
    """Compute the reduced potential energy of a system from the stored energies of its elements.

    The stored energy is an exact polynomial, so the elimination of x is exact as well.

    Args:
        system: The system, in doubles.
        exact_system: Builds the same system in another kind of number, from the numbers of its
            config. Then U belongs to the decimals that these numbers mean, and all that follows
            from them, such as the weight, is exact. By default the doubles of `system` are exact.

    Raises:
        NoReducedEnergy: The system has none, or it does not have the supported form.
    """
    reject_unsmooth(system)
    at_rest = configurations(system)
    try:
        energy, guard = _stored_energy(at_rest, exact_system, roots=0)
        if not energy.known:
            # At most one length for each element; a ring without them is faster.
            roots = len(system.elements)
            energy, guard = _stored_energy(at_rest, exact_system, roots)
        return _reduced(at_rest, energy, guard)
    except OverflowError as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_FINITE) from error


def _stored_energy(
    at_rest: Configurations, exact_system: ExactSystem | None, roots: int
) -> tuple[Polynomial, Guard | None]:
    """Return Π without barriers, in a ring with square roots, and the sum of the barriers."""
    # The lengths of lines depend on X too if the body is free.
    ring = Ring(3, at_rest.size - 3, roots=roots, roots_of_lengths=not at_rest.held)
    if exact_system is None:
        exact = map_parameters(at_rest.system, lambda _, value: ring.constants(value))
    else:
        exact = configurations(exact_system(ring.decimals)).system
    without, barriers = separated(exact)
    guard = guard_of(barriers)
    energy: Any = Configurations(without).energy(ring.variables())
    return energy if isinstance(energy, Polynomial) else ring.constant(energy), guard


def guard_of(barriers: Sequence[Barrier]) -> Guard | None:
    """Return the sum of the energies of some barriers; None if it is zero."""
    if any(exact_number(barrier.outer_stiffness) != 0 for barrier in barriers):
        raise NoReducedEnergy(NoEnergyReason.OUTER_BARRIER)
    stiffnesses = [exact_number(barrier.stiffness) for barrier in barriers]
    if any(stiffness < 0 for stiffness in stiffnesses):
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC)
    return Guard(float(sum(stiffnesses))) if any(stiffnesses) else None


def _reduced(at_rest: Configurations, energy: Polynomial, guard: Guard | None) -> ReducedEnergy:
    """Return the reduced energy of a stored energy and a barrier."""
    if not energy.known:
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC)
    try:
        if not at_rest.held:
            energy = _without_lengths(energy)
        reduced, minimizer = eliminated(energy)
        plain, lines = separated_lines(reduced) if at_rest.held else (reduced, ())
        return ReducedEnergy(
            at_rest,
            replace(form_of(plain), guard=guard, lines=lines),
            tuple(form_of(entry) for entry in minimizer),
        )
    except NoLength as error:
        raise NoReducedEnergy(NoEnergyReason.NO_LENGTH) from error
    except NotTrigonometric as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC) from error


def _without_lengths(energy: Polynomial) -> Polynomial:
    """Return the energy of a free body whose springs have no rest length: it is quadratic in X."""
    plain, weights = lengths_apart(energy)
    if any(weights):
        raise NoReducedEnergy(NoEnergyReason.FREE_LINES)
    return plain


def reject_unsmooth(system: System) -> None:
    """Raise `NoReducedEnergy` if an element is not smooth, supplies power, or is a user's.

    Not smooth are elements that switch or slide, and a damped spring without a rest length.
    """
    if any(element.from_user for element in system.elements):
        raise NoReducedEnergy(NoEnergyReason.USER_CODE)
    if system.supplies:
        raise NoReducedEnergy(NoEnergyReason.SUPPLIES)
    if has_modes(system):
        raise NoReducedEnergy(NoEnergyReason.SWITCHES)
    held = configurations(system).held
    for element in system.elements:
        # With a rest length, W has a kink where the line has no length; the proof keeps away from
        # it. Without one, nothing in W shows that the force of the damper has no direction there.
        if isinstance(element, Spring) and element.rest_length == 0 and not held:
            raise NoReducedEnergy(NoEnergyReason.NO_LENGTH)
        if isinstance(element, SlidingConnector):
            on_position = element.rate_weight == 0
            raise NoReducedEnergy(
                NoEnergyReason.NOT_SMOOTH if on_position else NoEnergyReason.NO_POTENTIAL
            )


def eliminated(energy: Polynomial) -> tuple[Polynomial, list[Polynomial]]:
    """Return U and x*, with b = ∂Π/∂x at x = 0 and H = ∂²Π/∂x²."""
    lengths = range(energy.ring.lengths)
    bare = energy.length_coefficient()
    if not lengths:
        return bare, []
    compliance = inverse_stiffness(energy)
    b = [energy.length_coefficient(i) for i in lengths]
    minimizer = [-sum((b[j] * compliance[i][j] for j in lengths), start=0 * bare) for i in lengths]
    # Π(Θ, x*) = Π(Θ, 0) + ½ b'x*, because b + Hx* = 0.
    reduced = bare + sum((b[i] * minimizer[i] for i in lengths), start=0 * bare) * 0.5
    return reduced, minimizer


def inverse_stiffness(energy: Polynomial) -> list[list[Polynomial]]:
    """Return H⁻¹, whose entries are constants."""
    from flint import fmpq_mat  # imported late, as in `polynomial`

    if energy.degree > 2:
        raise NoReducedEnergy(NoEnergyReason.NOT_QUADRATIC)
    ring, lengths = energy.ring, range(energy.ring.lengths)
    rows = [[_second_derivative(energy, i, j) for j in lengths] for i in lengths]
    minors = [fmpq_mat([row[:n] for row in rows[:n]]).det() for n in range(1, len(rows) + 1)]
    if not all(fraction(minor) > 0 for minor in minors):
        raise NoReducedEnergy(NoEnergyReason.NOT_HELD)
    inverse = fmpq_mat(rows).inv()
    wrapped = ring.context.constant
    return [[Polynomial(ring, wrapped(inverse[i, j])) for j in lengths] for i in lengths]


def _second_derivative(energy: Polynomial, i: int, j: int) -> "fmpq":
    """Return ∂²Π/∂x_i∂x_j: twice the coefficient of x_i², or the coefficient of x_i x_j."""
    value = (energy.length_coefficient(i, j) * (1 + (i == j))).constant_value
    if value is None:
        raise NoReducedEnergy(NoEnergyReason.NOT_QUADRATIC)
    return value
