"""Separate the ligaments of a system, whose energies are no polynomials of the lengths."""

from collections.abc import Sequence
from dataclasses import replace

from rbstab.analysis.configuration import Configurations
from rbstab.analysis.proof.ligaments.law import LigamentEnergy, ligament_energy
from rbstab.analysis.proof.multiple_angles import NotTrigonometric
from rbstab.analysis.proof.polynomial import Polynomial, Ring
from rbstab.elements.ligament import Ligament
from rbstab.elements.spring import squared_length
from rbstab.systems.system import System


def ligaments_apart(system: System) -> tuple[System, tuple[Ligament, ...]]:
    """Return a system without its ligaments, and the ligaments."""
    found = tuple(element for element in system.elements if isinstance(element, Ligament))
    others = tuple(element for element in system.elements if not isinstance(element, Ligament))
    return replace(system, elements=others), found


def squares_of(
    at_rest: Configurations, ligaments: Sequence[Ligament], ring: Ring
) -> list[Polynomial]:
    """Return the squares of the lengths of ligaments as polynomials in Θ and x.

    Raises:
        NotTrigonometric: One of them is none.
    """
    motion = at_rest.motion(ring.variables())
    found = list[Polynomial]()
    for ligament in ligaments:
        square = squared_length(motion, ligament.point, ligament.anchor)
        if not isinstance(square, Polynomial):
            square = ring.constant(square)
        if not square.known:
            raise NotTrigonometric
        found.append(square)
    return found


def laws_of(ligaments: Sequence[Ligament]) -> list[LigamentEnergy]:
    """Return the laws of ligaments whose parameters are exact."""
    return [ligament_energy(ligament) for ligament in ligaments]
