"""Separate the elements of users from a system: their energies as polynomials, or as programs."""

from dataclasses import replace
from typing import NamedTuple

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.proof.formulas.convexity import is_convex
from rbstab.analysis.proof.formulas.functions import MOST_POWER
from rbstab.analysis.proof.formulas.polynomials import (
    is_polynomial,
    is_quadratic,
    polynomial_of,
    taken_apart,
)
from rbstab.analysis.proof.formulas.program import MOST_OPERATIONS, Program
from rbstab.analysis.proof.polynomial import Ring
from rbstab.analysis.proof.traced.damping import NOTHING, Damping, damping_of
from rbstab.analysis.proof.traced.energy import TracedEnergy
from rbstab.analysis.proof.traced.kinked import KinkedEnergy
from rbstab.analysis.proof.traced.passive import why_not_passive
from rbstab.analysis.proof.traced.relaxing import relaxes
from rbstab.analysis.proof.traced.switching import (
    MOST_MODES,
    NotShownError,
    SwitchedEnergy,
    switched_energy,
)
from rbstab.analysis.proof.traced.tracing import (
    NotRecordedError,
    TracedStatements,
    own_entries,
    traced_statements,
)
from rbstab.elements.element import Element
from rbstab.integrate.straight_line.number import POWER
from rbstab.systems.system import System

NOT_QUADRATIC = (
    "it is not shown that its energy is a quadratic function of {}, with constant second "
    "derivatives"
)

NOT_CONVEX = (
    "it is not shown that its energy is a quadratic function of X, or convex in X, as sums of even "
    "powers of displacements are"
)

TOO_LARGE = "its energy has too many terms, or too large numbers"

NOT_RELAXING = (
    "it is not shown that its own states move down its energy while the body is at rest: `rates` "
    "must be -M times the derivative of `stored` then, with a constant positive definite M"
)


class NotInProofsError(Exception):
    """Proofs do not take an element of a user into account; the text says why."""


class TracedPart(NamedTuple):
    """A part of the energy of an element of a user, as a formula of Θ and X.

    Attributes:
        name: The name of the element.
        program: The formula.
    """

    name: str
    program: Program


class UserEnergies(NamedTuple):
    """The energies of the elements of users.

    Attributes:
        polynomials: Those that are polynomials of X and the own states, with quadratics and
            trigonometric polynomials of Θ, as programs.
        traced: Those of all others that depend on Θ alone.
        kinked: Their parts max(h, 0), where the force jumps; they depend on Θ alone.
        of_position: Those that depend on X too, without their terms among the polynomials.
    """

    polynomials: tuple[Program, ...]
    traced: tuple[TracedEnergy, ...]
    of_position: tuple[TracedPart, ...] = ()
    kinked: tuple[KinkedEnergy, ...] = ()


def in_proofs(element: Element) -> bool:
    """Return whether proofs may take an element of a user into account."""
    switches = element.mode_count > (0 if element.state_size else MOST_MODES)
    plain = not (switches or element.clearance_count)
    usual = type(element).at_rest is Element.at_rest and not (element.holds or element.slides)
    return plain and usual and not element.timed


def without_users(system: System) -> System:
    """Return a system without the elements of users."""
    return replace(system, elements=tuple(one for one in system.elements if not one.from_user))


def entries_without_users(at_rest: Configurations) -> list[int]:
    """Return the entries of q that are no own states of elements of users."""
    left = set(range(at_rest.size))
    for element in at_rest.system.elements:
        if element.from_user:
            left -= {3 + place for place in own_entries(at_rest, element)}
    return sorted(left)


def user_energies(at_rest: Configurations) -> UserEnergies:
    """Return the energies of the elements of users.

    Raises:
        NotInProofsError: The code of one cannot be recorded, or it is not shown to be passive, or
            its energy is of no kind that proofs take into account.
    """
    polynomials, traced = list[Program](), list[TracedEnergy]()
    of_position, kinked = list[TracedPart](), list[KinkedEnergy]()
    for element in at_rest.system.elements:
        if not element.from_user:
            continue
        statements = None if element.mode_count else _passive_statements(at_rest, element)
        if statements is None:
            program, kinks = _switched(at_rest, element)
        else:
            program, kinks = statements.energy, ()
        for one in (program, *kinks):
            _check_size(element.name, one)
        kinked += [KinkedEnergy(element.name, one) for one in kinks]
        if statements is not None and element.state_size:
            _check_polynomial(at_rest, element.name, statements)
            polynomials.append(program)
        elif not program.of_angles:
            quadratic, rest = taken_apart(program, Ring(3, at_rest.size - 3))
            polynomials += quadratic
            if rest is not None:
                if not is_convex(rest):
                    raise NotInProofsError(f"{element.name}: {NOT_CONVEX}")
                of_position.append(TracedPart(element.name, rest))
        elif is_polynomial(program):
            polynomials.append(program)
        else:
            traced.append(TracedEnergy(element.name, program))
    return UserEnergies(tuple(polynomials), tuple(traced), tuple(of_position), tuple(kinked))


def formula_count(system: System) -> int:
    """Return how many energies of users are no polynomials; 0 if not all are in proofs."""
    if not all(in_proofs(element) for element in system.elements if element.from_user):
        return 0
    try:
        users = user_energies(configurations(system))
        return len(users.traced) + len(users.kinked)
    except NotInProofsError:
        return 0


def _check_size(name: str, program: Program) -> None:
    """Raise `NotInProofsError` if a formula is too long, or has too large exponents."""
    if len(program.operations) > MOST_OPERATIONS:
        text = f"{name}: its energy has more than {MOST_OPERATIONS:,} operations"
        raise NotInProofsError(text)
    if any(one[0] == POWER and abs(one[2]) > MOST_POWER for one in program.operations):
        raise NotInProofsError(f"{name}: its energy has an exponent above {MOST_POWER}")


def _switched(at_rest: Configurations, element: Element) -> SwitchedEnergy:
    """Return the energy of an element that switches."""
    try:
        return switched_energy(at_rest, element)
    except (RecursionError, OverflowError) as error:
        raise NotInProofsError(f"{element.name}: {TOO_LARGE}") from error
    except (NotRecordedError, NotShownError) as error:
        cannot = "its code cannot be recorded: " if isinstance(error, NotRecordedError) else ""
        raise NotInProofsError(f"{element.name}: {cannot}{error}") from error


def _passive_statements(at_rest: Configurations, element: Element) -> TracedStatements:
    """Return the statements of an element that does not switch; it is shown to be passive."""
    try:
        statements = traced_statements(at_rest, element)
    except NotRecordedError as error:
        text = f"{element.name}: its code cannot be recorded: {error}"
        raise NotInProofsError(text) from error
    why = why_not_passive(statements)
    if why is not None:
        raise NotInProofsError(f"{element.name}: {why}")
    return statements


def damping_of_users(system: System) -> Damping:
    """Return which motions the elements of users damp that do not switch.

    It is nothing, if one of them is not in proofs.
    """
    users = [element for element in system.elements if element.from_user]
    if not all(map(in_proofs, users)):
        return NOTHING
    at_rest = configurations(system)
    smooth = [element for element in users if not element.mode_count]
    try:
        return damping_of(_passive_statements(at_rest, element) for element in smooth)
    except (NotInProofsError, RecursionError):
        return NOTHING


def _check_polynomial(at_rest: Configurations, name: str, statements: TracedStatements) -> None:
    """Check that an energy is quadratic in x, and that own states move down in it."""
    energy = polynomial_of(statements.energy, Ring(3, at_rest.size - 3))
    if energy is None or not is_quadratic(energy):
        of_what = "its own states" if at_rest.held else "X and its own states"
        raise NotInProofsError(f"{name}: {NOT_QUADRATIC.format(of_what)}")
    if statements.own and not relaxes(energy, statements.own, statements.own_rates):
        raise NotInProofsError(f"{name}: {NOT_RELAXING}")
