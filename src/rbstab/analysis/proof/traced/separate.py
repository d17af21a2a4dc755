"""Separate the elements of users from a system: their energies as polynomials, or as programs."""

from dataclasses import replace
from typing import NamedTuple

from rbstab.analysis.configuration import Configurations
from rbstab.analysis.proof.traced.energy import TracedEnergy
from rbstab.analysis.proof.traced.functions import MOST_POWER
from rbstab.analysis.proof.traced.passive import why_not_passive
from rbstab.analysis.proof.traced.polynomials import is_polynomial
from rbstab.analysis.proof.traced.program import MOST_OPERATIONS, Program
from rbstab.analysis.proof.traced.tracing import NotRecordedError, traced_statements
from rbstab.elements.element import Element
from rbstab.integrate.straight_line.number import POWER
from rbstab.systems.system import System


class NotInProofsError(Exception):
    """Proofs do not take an element of a user into account; the text says why."""


class UserEnergies(NamedTuple):
    """The energies of the elements of users.

    Attributes:
        polynomials: Those that are quadratics plus trigonometric polynomials, as programs.
        traced: All others.
    """

    polynomials: tuple[Program, ...]
    traced: tuple[TracedEnergy, ...]


def in_proofs(element: Element, *, held: bool) -> bool:
    """Return whether proofs may take an element of a user into account."""
    plain = not (element.mode_count or element.state_size or element.clearance_count)
    usual = type(element).at_rest is Element.at_rest and not (element.holds or element.slides)
    return held and plain and usual and not element.timed


def without_users(system: System) -> System:
    """Return a system without the elements of users."""
    return replace(system, elements=tuple(one for one in system.elements if not one.from_user))


def user_energies(at_rest: Configurations) -> UserEnergies:
    """Return the energies of the elements of users of a held body.

    Raises:
        NotInProofsError: The code of one cannot be recorded, or it is not shown to be passive.
    """
    polynomials, traced = list[Program](), list[TracedEnergy]()
    for element in at_rest.system.elements:
        if not element.from_user:
            continue
        try:
            statements = traced_statements(at_rest, element)
        except NotRecordedError as error:
            text = f"{element.name}: its code cannot be recorded: {error}"
            raise NotInProofsError(text) from error
        why = why_not_passive(statements)
        if why is not None:
            raise NotInProofsError(f"{element.name}: {why}")
        program = statements.energy
        if len(program.operations) > MOST_OPERATIONS:
            text = f"{element.name}: its energy has more than {MOST_OPERATIONS:,} operations"
            raise NotInProofsError(text)
        if any(one[0] == POWER and abs(one[2]) > MOST_POWER for one in program.operations):
            text = f"{element.name}: its energy has an exponent above {MOST_POWER}"
            raise NotInProofsError(text)
        if is_polynomial(program):
            polynomials.append(program)
        else:
            traced.append(TracedEnergy(element.name, program))
    return UserEnergies(tuple(polynomials), tuple(traced))
