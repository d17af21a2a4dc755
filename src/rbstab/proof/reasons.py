"""Why a system has no potential energy that a proof is about."""

from collections.abc import Iterator
from enum import Enum

import numpy as np

from rbstab.elements.guards.barrier import Barrier
from rbstab.elements.guards.soft_guards import SoftGuard
from rbstab.elements.guards.stop import Stop
from rbstab.elements.ligament import Ligament
from rbstab.elements.motors import Hard, OfAngles
from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.spring import Spring
from rbstab.mechanics.numbers import Array
from rbstab.proof.passive.passive import in_proofs, why_not_in_proofs
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

SMALLEST, LARGEST = 1e-90, 1e90
"""The least and the largest magnitude of a number in a proof, but for zero."""

SWITCHING = (Ligament, SoftGuard, Stop, Barrier, Hard)
"""Elements of the program that may switch: their energies are in proofs."""


class NoEnergyReason(Enum):
    """Why a system has no potential energy for proofs; the value is the text to show."""

    NO_POTENTIAL = "the connector's force on the surface s = F + κE has no potential"
    NOT_SMOOTH = "the energy K_s|E| of the sliding connector has no gradient at E = 0"
    SWITCHES = "an element switches, so its energy is not one formula for all attitudes"
    HARD_LIMIT = (
        "a hard limit acts on the position of a body that is not held; law: smooth is in proofs"
    )
    SUPPLIES = "an element supplies power"
    USER_CODE = (
        "an element is code of a user, and proofs take it into account only if it has at most 6 "
        "switches, and no stop of its own"
    )
    NOT_IN_PROOFS = "no proof takes this code of a user into account"
    NOT_HELD = "nothing holds the position: the energy has no single minimum over X and D"
    NOT_BALANCED = (
        "at Θ = 0 no position was found where the forces balance: the limit of a motor may be "
        "below the load"
    )
    NOT_FINITE = (
        f"a number of the energy is too small or too large: proofs take {SMALLEST:g} to {LARGEST:g}"
        " in SI units"
    )
    STOP_BESIDE_SPRINGS = (
        "the body is not held, and no proof takes springs beside a stop into account then"
    )
    NO_LENGTH = (
        "the line of a spring may have no length at some attitude, and then its force no direction"
    )
    # The following are about all bodies within tolerances.
    CODE = "the code of a user is not made of formulas that a proof can follow"
    NOT_QUADRATIC = "the energy is not a quadratic function of X and D with constant stiffness"
    DIVISOR = "a divisor may be zero for some body"
    STOP_VARIES = "the angle of a stop varies"
    HELD_ALONG = "a stop, or a force that jumps, may hold the body at rest"
    NO_LENGTH_OF_SOME = "a spring of some body may have no length at some attitude"


SEARCHED_INSTEAD = frozenset(
    {
        NoEnergyReason.USER_CODE,
        NoEnergyReason.NOT_IN_PROOFS,
        NoEnergyReason.HARD_LIMIT,
        NoEnergyReason.STOP_BESIDE_SPRINGS,
        NoEnergyReason.NO_LENGTH,
    }
)
"""The reasons for which nothing is proved of rest states that can be looked for."""


class NoReducedEnergy(Exception):
    """A system has no potential energy for proofs; `reason` names the reason."""

    def __init__(self, reason: NoEnergyReason, detail: str | None = None) -> None:
        super().__init__(reason.value if detail is None else f"{reason.value}: {detail}")
        self.reason = reason


def reject(system: System) -> None:
    """Raise `NoReducedEnergy` if proofs do not take an element, or a number, into account."""
    map_parameters(system, _reject_sizes)
    reason = next(_reasons(system), None)
    if reason is not None:
        raise NoReducedEnergy(reason)
    why = why_not_in_proofs(system)
    if why is not None:
        raise NoReducedEnergy(NoEnergyReason.NOT_IN_PROOFS, why)


def without_potential(system: System) -> Iterator[NoEnergyReason]:
    """Yield why elements of the program have no potential: they slide, or supply power."""
    if system.supplies:
        yield NoEnergyReason.SUPPLIES
    for element in system.elements:
        if isinstance(element, SlidingConnector):
            on_position = element.rate_weight == 0
            yield NoEnergyReason.NOT_SMOOTH if on_position else NoEnergyReason.NO_POTENTIAL


def _reasons(system: System) -> Iterator[NoEnergyReason]:
    if not all(in_proofs(element) for element in system.elements if element.from_user):
        yield NoEnergyReason.USER_CODE
    yield from without_potential(system)
    for element in system.elements:
        if element.mode_count and not (element.from_user or isinstance(element, SWITCHING)):
            yield NoEnergyReason.SWITCHES
        of_position = isinstance(element, Hard) and not isinstance(element, OfAngles)
        if of_position and not system.coordinates.holds_contact:
            yield NoEnergyReason.HARD_LIMIT
        # Without a rest length, nothing in the energy shows that the force of the damper has no
        # direction where the line has no length.
        without = isinstance(element, Spring) and element.rest_length == 0
        if without and not system.coordinates.holds_contact:
            yield NoEnergyReason.NO_LENGTH


def _reject_sizes(name: str, value: Array) -> Array:
    size = np.abs(np.asarray(value, dtype=float))
    if not np.all((size == 0) | ((size >= SMALLEST) & (size <= LARGEST))):
        raise NoReducedEnergy(NoEnergyReason.NOT_FINITE, f"{name} is {value.tolist()}")
    return value
