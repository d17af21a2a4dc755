"""Separate the elements of users from a system: their energies as polynomials, or as programs.

That they are passive is another question (`rbstab.proof.passive.passive`).
"""

from dataclasses import replace
from itertools import chain
from typing import NamedTuple

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.proof.boxes import RANGE_END, grid
from rbstab.analysis.proof.formulas.convexity import is_convex
from rbstab.analysis.proof.formulas.functions import MOST_POWER
from rbstab.analysis.proof.formulas.polynomials import (
    is_polynomial,
    is_quadratic,
    polynomial_of,
    taken_apart,
)
from rbstab.analysis.proof.formulas.program import MOST_OPERATIONS, Program, counted_from
from rbstab.analysis.proof.polynomial import Ring
from rbstab.analysis.proof.traced.energy import TracedEnergy
from rbstab.analysis.proof.traced.kinked import KinkedEnergy
from rbstab.analysis.proof.traced.own_states import MOST_STATES, OwnStatesEnergy
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
    "it is not shown that its energy is a quadratic function of X and its own states, with "
    "constant second derivatives"
)

NOT_CONVEX_IN_STATES = (
    "it is not shown that its energy is convex in its own states, as sums of even powers of "
    "displacements are"
)

NO_LEAST_ENERGY = (
    "at some attitude no least energy over its own states is found, at which the second "
    "derivatives are positive definite"
)

TOO_MANY_STATES = f"its energy is not quadratic, and it has more than {MOST_STATES} own states"

NOT_CONVEX = (
    "it is not shown that its energy is a quadratic function of X, or convex in X, as sums of even "
    "powers of displacements are"
)

TOO_LARGE = "its energy has too many terms, or too large numbers"

SOME_ATTITUDES = (4, 3, 4)
"""The attitudes by axis at which a least energy over own states must be found."""

COST_OF_STATES = 2
"""Bounds on a least energy over own states take as long as those of so many formulas of Θ."""


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


class ConvexInStates(NamedTuple):
    """An energy that is convex in own states.

    Attributes:
        entries: The entries of x = D that are these states.
        least: Its least value over them.
    """

    entries: range
    least: OwnStatesEnergy


class UserEnergies(NamedTuple):
    """The energies of the elements of users.

    Attributes:
        polynomials: Those that are polynomials of X and the own states, with quadratics and
            trigonometric polynomials of Θ, as programs.
        traced: Those of all others that depend on Θ alone.
        kinked: Their parts max(h, 0) and min(h, 0), where the force jumps; of Θ alone.
        own_states: Those of a held body that are convex in own states, and not quadratic.
        of_position: Those that depend on X too, without their terms among the polynomials.
    """

    polynomials: tuple[Program, ...] = ()
    traced: tuple[TracedEnergy, ...] = ()
    of_position: tuple[TracedPart, ...] = ()
    kinked: tuple[KinkedEnergy, ...] = ()
    own_states: tuple[ConvexInStates, ...] = ()


def in_proofs(element: Element) -> bool:
    """Return whether proofs may take an element of a user into account."""
    plain = element.mode_count <= MOST_MODES and not element.clearance_count
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
        NotInProofsError: The code of one cannot be recorded, or its energy is of no kind that
            proofs take into account.
    """
    users = (element for element in at_rest.system.elements if element.from_user)
    found = [UserEnergies(), *(_energies_of(at_rest, element) for element in users)]
    return UserEnergies(*(tuple(chain(*parts)) for parts in zip(*found, strict=True)))


def _energies_of(at_rest: Configurations, element: Element) -> UserEnergies:
    """Return the energies of one element of a user."""
    if element.mode_count:
        program, valleys, ridges = _switched(at_rest, element)
    else:
        program, valleys, ridges = _recorded_statements(at_rest, element).energy, (), ()
    for one in (program, *valleys, *ridges):
        _check_size(element.name, one)
    if element.state_size:
        found = _of_own_states(at_rest, element, program)
    elif program.of_angles:
        found = _of_angles(element.name, program)
    else:
        found = _of_position(at_rest, element.name, program)
    kinks = [(one, False) for one in valleys] + [(one, True) for one in ridges]
    return found._replace(kinked=tuple(KinkedEnergy(element.name, *one) for one in kinks))


def _of_angles(name: str, program: Program) -> UserEnergies:
    """Return an energy of Θ alone."""
    if is_polynomial(program):
        return UserEnergies(polynomials=(program,))
    return UserEnergies(traced=(TracedEnergy(name, program),))


def _of_position(at_rest: Configurations, name: str, program: Program) -> UserEnergies:
    """Return an energy of Θ and X.

    Raises:
        NotInProofsError: It is neither quadratic in X, nor convex in X.
    """
    quadratic, rest = taken_apart(program, Ring(3, at_rest.size - 3))
    if rest is not None and not is_convex(rest):
        raise NotInProofsError(f"{name}: {NOT_CONVEX}")
    of_position = () if rest is None else (TracedPart(name, rest),)
    return UserEnergies(polynomials=tuple(quadratic), of_position=of_position)


def formula_count(system: System) -> int:
    """Return how many formulas the energies of users that are no polynomials take as long as.

    It is 0 if not all are in proofs.
    """
    if not all(in_proofs(element) for element in system.elements if element.from_user):
        return 0
    try:
        users = user_energies(configurations(system))
        return len(users.traced) + len(users.kinked) + COST_OF_STATES * len(users.own_states)
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


def _recorded_statements(at_rest: Configurations, element: Element) -> TracedStatements:
    """Return the statements of an element that does not switch."""
    try:
        return traced_statements(at_rest, element)
    except NotRecordedError as error:
        text = f"{element.name}: its code cannot be recorded: {error}"
        raise NotInProofsError(text) from error


def _of_own_states(at_rest: Configurations, element: Element, program: Program) -> UserEnergies:
    """Return the energy of an element with own states, without its jumps.

    Raises:
        NotInProofsError: It is neither quadratic in x nor convex in the own states.
    """
    name, own = element.name, own_entries(at_rest, element)
    ring = Ring(3, at_rest.size - 3)
    polynomial = polynomial_of(program, ring)
    if polynomial is not None and is_quadratic(polynomial):
        return UserEnergies(polynomials=(program,))
    quadratic, rest = taken_apart(program, ring)
    if rest is not None and rest.of_angles:
        return _of_angles(name, rest)._replace(polynomials=tuple(quadratic))
    if not at_rest.held:
        raise NotInProofsError(f"{name}: {NOT_QUADRATIC}")
    if not is_convex(program):
        raise NotInProofsError(f"{name}: {NOT_CONVEX_IN_STATES}")
    if len(own) > MOST_STATES:
        raise NotInProofsError(f"{name}: {TOO_MANY_STATES}")
    least = OwnStatesEnergy(name, counted_from(own.start, program), len(own))
    if not least.has_values(grid(RANGE_END, SOME_ATTITUDES).centre):
        raise NotInProofsError(f"{name}: {NO_LEAST_ENERGY}")
    return UserEnergies(own_states=(ConvexInStates(own, least),))
