"""The reduced energies of all bodies in a box."""

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.proof.guards.separate import guards_apart, has_switching_guards
from rbstab.analysis.proof.polynomial import Polynomial
from rbstab.analysis.proof.reduced_energy import (
    NoEnergyReason,
    NoReducedEnergy,
    reject_unsmooth,
)
from rbstab.analysis.proof.robust.elimination import eliminated_for_all
from rbstab.analysis.proof.robust.expansion import family_of
from rbstab.analysis.proof.robust.family import FormFamily
from rbstab.analysis.proof.robust.numbers import BodiesRing, Members, Part
from rbstab.elements.ligament import Ligament
from rbstab.elements.spring import Spring


@dataclass(frozen=True, eq=False)
class Energies:
    """The energies U of the bodies in a box.

    varied are the indices of the numbers that U depends on, in the order of the family's shares.
    """

    family: FormFamily
    varied: tuple[int, ...]


def energies_of(members: Members, part: Part) -> Energies:
    """Compute the reduced energies of all bodies in a box, each up to a constant.

    Args:
        members: Builds the system of a member.
        part: The box of bodies.

    Raises:
        NoReducedEnergy: They have none, or the box is too wide for the series.
    """
    ring, energy = stored_energy(members, part)
    try:
        family = family_of(eliminated_for_all(energy))
        family.errors  # noqa: B018 computed here, so that an overflow is found
    except OverflowError as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_FINITE) from error
    return Energies(family, tuple(ring.varied))


def relevant(members: Members, part: Part) -> Part:
    """Return a box without the widths of the numbers that have no effect on U.

    These are inertia and damping, and the mass of a body without weight.
    """
    ring, energy = stored_energy(members, part)
    used = {
        place
        for powers, _ in energy.terms()
        for place, power in enumerate(ring.split(powers).parameters)
        if power
    }
    radius = [Fraction(0)] * len(part.radius)
    for place, k in enumerate(ring.varied):
        if place in used:
            radius[k] = part.radius[k]
    return replace(part, radius=tuple(radius))


def stored_energy(members: Members, part: Part) -> tuple[BodiesRing, Polynomial]:
    """Return Π as a polynomial in Θ, x and z."""
    middle = members([float(number) for number in part.middle], _doubles)
    reject_unsmooth(middle)
    if any(element.from_user for element in middle.elements):
        raise NoReducedEnergy(NoEnergyReason.CODE_OF_BODIES)
    if has_switching_guards(middle):
        raise NoReducedEnergy(NoEnergyReason.SWITCHING_GUARDS_OF_BODIES)
    if guards_apart(middle)[1]:
        raise NoReducedEnergy(NoEnergyReason.BARRIER_OF_BODIES)
    if any(isinstance(element, Spring | Ligament) for element in middle.elements):
        raise NoReducedEnergy(NoEnergyReason.LINES_OF_BODIES)
    ring = BodiesRing(configurations(middle).size - 3, part)
    try:
        system = members(ring.numbers, ring.converted)
        energy: Any = Configurations(configurations(system).system).energy(ring.variables())
    except OverflowError as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_FINITE) from error
    if not isinstance(energy, Polynomial):
        energy = ring.constant(energy)
    if not energy.known:
        raise NoReducedEnergy(NoEnergyReason.NOT_TRIGONOMETRIC)
    return ring, energy


def _doubles(numbers: Any) -> Any:
    return np.asarray(numbers, dtype=float)
