"""The reduced potential energy: what is stored at a given attitude when all else has settled."""

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.proof.multiple_angles import NotTrigonometric, form_of
from rbstab.analysis.proof.polynomial import Polynomial, Ring, fraction
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.elements.sliding import SlidingConnector
from rbstab.mechanics.numbers import Array
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

if TYPE_CHECKING:
    from flint import fmpq


class Refusal(Enum):
    """Why a system has no reduced potential energy; the value says it in words."""

    NO_POTENTIAL = "the connector's force on the surface s = F + κE has no potential"
    NOT_SMOOTH = "the energy K_s|E| of the sliding connector has no gradient at E = 0"
    NOT_HELD = "nothing holds the position: the energy has no single minimum over X and D"
    NOT_QUADRATIC = "the energy is not a quadratic function of X and D with constant stiffness"
    NOT_TRIGONOMETRIC = (
        "the energy is not a quadratic function of Θ plus a polynomial in its sines and cosines"
    )


class NoReducedEnergy(Exception):
    """A system has no reduced potential energy; `refusal` names the reason."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.value)
        self.refusal = refusal


@dataclass(frozen=True, eq=False)
class ReducedEnergy:
    """U(Θ) = min over x of Π(Θ, x), with x = [X, D] (x = D where the contact point is held).

    Π, the stored energy, is quadratic in x, so x* = -H⁻¹b(Θ) and U = Π(Θ, 0) - ½ b'H⁻¹b. A zero of
    ∂U/∂Θ is a rest state, and each rest state is one.

    configurations are those of the system; form is U; settled are the entries of x*.
    """

    configurations: Configurations
    form: TrigonometricForm
    settled: tuple[TrigonometricForm, ...]

    def configuration(self, Theta: Array) -> Array:
        """q = [Θ, x*(Θ)], shape (size,)."""
        values = [form.value(Theta[np.newaxis])[0] for form in self.settled]
        return np.concatenate([Theta, values])


def reduced_energy(system: System) -> ReducedEnergy:
    """The reduced potential energy of a system, from what its elements say that they store.

    The stored energy is taken as an exact polynomial, so the elimination is exact as well.

    Raises:
        NoReducedEnergy: There is none, or none of the form that is understood here.
    """
    _refuse_sliding(system)
    still = configurations(system)
    ring = Ring(3, still.size - 3)
    exact = map_parameters(still.system, lambda _, value: ring.constants(value))
    energy = Configurations(exact).energy(ring.variables())
    if not isinstance(energy, Polynomial):
        energy = ring.constant(energy)
    if not energy.known:
        raise NoReducedEnergy(Refusal.NOT_TRIGONOMETRIC)
    reduced, settled = _eliminated(energy)
    try:
        return ReducedEnergy(still, form_of(reduced), tuple(form_of(entry) for entry in settled))
    except NotTrigonometric as error:
        raise NoReducedEnergy(Refusal.NOT_TRIGONOMETRIC) from error


def _refuse_sliding(system: System) -> None:
    for element in system.elements:
        if isinstance(element, SlidingConnector):
            on_position = element.rate_weight == 0
            raise NoReducedEnergy(Refusal.NOT_SMOOTH if on_position else Refusal.NO_POTENTIAL)


def _eliminated(energy: Polynomial) -> tuple[Polynomial, list[Polynomial]]:
    """U and x*, with b = ∂Π/∂x at x = 0 and H = ∂²Π/∂x²."""
    lengths = range(energy.ring.lengths)
    bare = energy.length_coefficient()
    if not lengths:
        return bare, []
    compliance = _inverse_stiffness(energy)
    b = [energy.length_coefficient(i) for i in lengths]
    settled = [-sum((b[j] * compliance[i][j] for j in lengths), start=0 * bare) for i in lengths]
    # Π(Θ, x*) = Π(Θ, 0) + ½ b'x*, for x* is where b + Hx = 0.
    reduced = bare + sum((b[i] * settled[i] for i in lengths), start=0 * bare) * 0.5
    return reduced, settled


def _inverse_stiffness(energy: Polynomial) -> list[list[Polynomial]]:
    """H⁻¹, whose entries are constants."""
    from flint import fmpq_mat  # late, as in `polynomial`

    if energy.degree > 2:
        raise NoReducedEnergy(Refusal.NOT_QUADRATIC)
    ring, lengths = energy.ring, range(energy.ring.lengths)
    rows = [[_second_derivative(energy, i, j) for j in lengths] for i in lengths]
    minors = [fmpq_mat([row[:n] for row in rows[:n]]).det() for n in range(1, len(rows) + 1)]
    if not all(fraction(minor) > 0 for minor in minors):
        raise NoReducedEnergy(Refusal.NOT_HELD)
    inverse = fmpq_mat(rows).inv()
    wrapped = ring.context.constant
    return [[Polynomial(ring, wrapped(inverse[i, j])) for j in lengths] for i in lengths]


def _second_derivative(energy: Polynomial, i: int, j: int) -> "fmpq":
    """∂²Π/∂x_i∂x_j: the term of x_i² carries half of it, that of x_i x_j all."""
    value = (energy.length_coefficient(i, j) * (1 + (i == j))).constant_value
    if value is None:
        raise NoReducedEnergy(Refusal.NOT_QUADRATIC)
    return value
