"""The stored energy of a body with springs that is tied, as a function of Θ and of a shift z.

Without the lengths of its springs the stored energy is quadratic in x = [X, D], with the minimizer
x*(Θ). Let z = X - X*(Θ). With the least energy over D,

    W(Θ, z) = U(Θ) + ½ z'Sz + Σ w_j |e_j|    e_j = z + r_j(Θ)

where U is a form, perhaps with a barrier on θ2, S is constant and positive definite, and e_j is the
line of a spring.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.proof.guard import Guard, separated
from rbstab.analysis.proof.lines.separate import lengths_apart
from rbstab.analysis.proof.multiple_angles import NotTrigonometric, form_of
from rbstab.analysis.proof.polynomial import Polynomial, Ring, fraction
from rbstab.analysis.proof.reduced_energy import (
    ExactSystem,
    NoEnergyReason,
    NoReducedEnergy,
    eliminated,
    guard_of,
    inverse_stiffness,
    reject_unsmooth,
)
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

POSITION = range(3)
"""The places of X in x."""


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
    """W(Θ, z) = U(Θ) + ½ z'Sz + Σ w_j |z + r_j(Θ)|, J; each number is exact and rounded once.

    Args:
        form: U.
        stiffness: S, shape (3, 3), N/m.
        compliance: S⁻¹, shape (3, 3), m/N.
        lines: The lines, with w < 0. A spring without a rest length has none: w is 0.
        minimizer: The entries of x*(Θ).
        own: H_DD⁻¹H_DX, shape (own states, 3): D = D* minus this times z.
        configurations: The configurations of the system.
    """

    form: TrigonometricForm
    stiffness: Array
    compliance: Array
    lines: tuple[FreeLine, ...]
    minimizer: tuple[TrigonometricForm, ...]
    own: Array
    configurations: Configurations

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
        ring = Ring(3, at_rest.size - 3, roots=len(system.elements), roots_of_lengths=True)
        without, barriers = separated(configurations(exact_system(ring.decimals)).system)
        guard = guard_of(barriers)
        energy: Any = Configurations(without).energy(ring.variables())
        if not isinstance(energy, Polynomial) or not energy.known:
            raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC)
        return _tied(at_rest, energy, guard)
    except NotTrigonometric as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC) from error
    except OverflowError as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_FINITE) from error


def tied_energy_of_doubles(system: System) -> TiedEnergy:
    """Return W with the doubles of a system as exact numbers."""

    def exact(convert: Any) -> System:
        return map_parameters(configurations(system).system, lambda _, value: convert(value))

    return tied_energy(system, exact)


def _tied(at_rest: Configurations, energy: Polynomial, guard: Guard | None) -> TiedEnergy:
    """Return W of a stored energy with lengths, and of a barrier."""
    plain, weights = lengths_apart(energy)
    reduced, minimizer = eliminated(plain)
    compliance = [[_number(entry) for entry in row] for row in inverse_stiffness(plain)]
    if any(weight > 0 for weight in weights):
        # A line that pulls at any length could be at rest without a length.
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC)
    block = [[compliance[i][j] for j in POSITION] for i in POSITION]
    pairs = zip(weights, energy.ring.squares, strict=True)
    return TiedEnergy(
        replace(form_of(reduced), guard=guard),
        np.array([[float(entry) for entry in row] for row in _inverse(block)]),
        np.array([[float(entry) for entry in row] for row in block]),
        tuple(
            FreeLine(float(weight), _offset(square, minimizer))
            for weight, square in pairs
            if weight != 0
        ),
        tuple(form_of(entry) for entry in minimizer),
        _own(compliance),
        at_rest,
    )


def _offset(square: Polynomial, minimizer: Sequence[Polynomial]) -> tuple[TrigonometricForm, ...]:
    """Return r(Θ) of a line with the squared length |X + ρ(Θ)|²: ρ + X*.

    Raises:
        NotTrigonometric: The square is none of this form.
    """
    lengths = range(square.ring.lengths)
    shift = [square.length_coefficient(i) * 0.5 for i in POSITION]
    of_X = {(i, i): 1 for i in POSITION}
    zeros = [square.length_coefficient() - sum((one * one for one in shift), start=0 * square)]
    zeros += [square.length_coefficient(i) for i in lengths if i not in POSITION]
    zeros += [
        square.length_coefficient(i, j) - of_X.get((i, j), 0) for i in lengths for j in lengths[i:]
    ]
    # A form is unique, so it shows whether a polynomial in sines and cosines is zero.
    if square.degree > 2 or any(np.any(form_of(zero).coefficients) for zero in zeros):
        raise NotTrigonometric
    return tuple(form_of(one + minimizer[i]) for i, one in enumerate(shift))


def _own(compliance: list[list[Fraction]]) -> Array:
    """Return H_DD⁻¹H_DX = -(H⁻¹)_DX ((H⁻¹)_XX)⁻¹."""
    C = np.array([[float(entry) for entry in row] for row in compliance])
    found: Array = -C[3:, :3] @ np.linalg.inv(C[:3, :3])
    return found


def _number(constant: Polynomial) -> Fraction:
    value = constant.constant_value
    assert value is not None
    return fraction(value)


def _inverse(rows: list[list[Fraction]]) -> list[list[Fraction]]:
    from flint import fmpq, fmpq_mat  # imported late, as in `polynomial`

    matrix = fmpq_mat([[fmpq(x.numerator, x.denominator) for x in row] for row in rows]).inv()
    return [[fraction(matrix[i, j]) for j in range(3)] for i in range(3)]
