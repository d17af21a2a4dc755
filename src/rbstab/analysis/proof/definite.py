"""The matrices that must be positive definite in the theorems of proofs.md, checked exactly."""

from fractions import Fraction

from rbstab.analysis.exact import exact_rank, is_positive_definite
from rbstab.analysis.proof.traced.damping import NOTHING, Damping
from rbstab.elements.attitude_spring import AttitudeSpring
from rbstab.elements.declarations import Gain
from rbstab.elements.element import Element
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

STOP_TURNING = (RotationalStabilizer, AttitudeSpring)
"""Kinds of elements that dissipate Ω'LΩ: without dissipation Ω = 0."""

STOP_MOVING = (TranslationalStabilizer, ViscoElasticConnector, EmbeddedConnector)
"""Those that dissipate V'LV, or the same of the velocity of a point: V, where Ω = 0."""


def damps_every_motion(system: System, of_users: Damping = NOTHING) -> bool:
    """Return whether elements act whose dissipation is zero only at rest.

    One of them damps Ω, and another one V, unless the contact point is held: then V follows from Ω.
    Their damping matrices are positive definite (`indefinite_parameter`), those of own states too.
    Other elements may damp all motions together, but that is not shown here.

    Args:
        system: The system, with or without its elements of users.
        of_users: What these damp.
    """
    damped = _damped(system, of_users)
    return damped.turning and (damped.moving or system.coordinates.holds_contact)


def undamped_by(system: System, of_users: Damping = NOTHING) -> list[str]:
    """Return which gains of the stabilizers would damp what nothing damps: ["L_r is 0"]."""
    damped, held = _damped(system, of_users), system.coordinates.holds_contact
    missing = (RotationalStabilizer,) if not damped.turning else ()
    if not (damped.moving or held):
        missing = (TranslationalStabilizer, *missing)
    return [
        f"{gain.name} is {'singular' if getattr(one, gain.name).any() else '0'}"
        for one in system.elements
        if isinstance(one, missing)
        for gain in one.gains
        if gain.dissipates
    ]


def _damped(system: System, of_users: Damping) -> Damping:
    own = [one for one in system.elements if not one.from_user and _damps_fully(one)]
    turning = of_users.turning or any(isinstance(element, STOP_TURNING) for element in own)
    moving = of_users.moving or any(isinstance(element, STOP_MOVING) for element in own)
    return Damping(turning, moving)


def _damps_fully(element: Element) -> bool:
    """Return whether no damping matrix of an element is singular."""
    damping = (getattr(element, gain.name) for gain in element.gains if gain.dissipates)
    return all(map(is_positive_definite, damping))


def indefinite_parameter(system: System) -> str | None:
    """Return the name of a parameter that is not positive definite; None if all of them are.

    Checked are the mass, the inertia and each damping matrix. Then the kinetic energy is a norm of
    the velocities, and no damping matrix adds energy. Those that a config may leave out need only
    be semidefinite: what all of them damp is another question (`damps_every_motion`). The stiffness
    of X and D is checked in sum, where these are eliminated (`reduced_energy`).

    Args:
        system: The system in rational numbers, or in doubles, which are taken as exact.
    """
    if not Fraction(system.body.mass) > 0:
        return "mass"
    if not is_positive_definite(system.body.inertia):
        return "inertia"
    for element in system.elements:
        # That elements of users never dissipate less than nothing is another question
        # (`traced.passive`).
        for gain in () if element.from_user else element.gains:
            if gain.dissipates and not _damps(getattr(element, gain.name), gain):
                return gain.name
    return None


def _damps(matrix: Array, gain: Gain) -> bool:
    may_be_left_out = gain.default is not None
    return exact_rank(matrix) is not None if may_be_left_out else is_positive_definite(matrix)
