"""The energy as a function of the rotation A alone, traced without Euler angles.

The nine entries of A are variables. Θ, B and the time are None, with which no formula can compute,
so an element that depends on Euler angles is noticed where it does.
"""

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.elements.attitude_spring import AttitudeSpring
from rbstab.elements.element import Element
from rbstab.elements.ligament import Ligament
from rbstab.elements.motors import OfAngles
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.spring import Spring
from rbstab.mechanics import contact
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.proof.exact.expr import Expr, expr, numbers, variables
from rbstab.proof.exact.rewriting import with_unit_steps
from rbstab.proof.model import Energy, ExactSystem, NoMinimumError, eliminated, with_steps
from rbstab.proof.passive.statements import state_numbers_of
from rbstab.systems.system import System

ENTRIES = 1000
"""The number of the variable A_ij is `ENTRIES` + 3i + j, with i and j from 0."""

RATES = 2000
"""Those of Ω, and then of V, while it is traced what an element reads."""

NO_POSITION = "nothing holds the position of the body"


class NotOnRotationsError(Exception):
    """The energy is no function of the rotation alone; the message says why."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RotationEnergy(Energy):
    """The stored energy U(A, z), J: A_ij is the variable `ENTRIES` + 3i + j, in place of Θ.

    Args:
        just_taut: For each ligament with a damper ½((ℓ/ℓ₀)² - 1) as a function of A; None where
            the position is not a function of A.
    """

    just_taut: dict[str, Expr | None]


def rotation_energy(system: System, exact_system: ExactSystem) -> RotationEnergy:
    """Return the energy of a system as a function of the rotation (Q2, Q3 and Q6 of theorem 15).

    Q2: all elements are smooth, or ligaments, and no code of users; what they exert, store and
    dissipate, and the rates of their own states, are traced with A, X, Ω, V and own states only
    (`_read_rotations_only`). Q3: X and own states are eliminated with exact pivots, or all in which
    U is not quadratic is convex (`eliminated`, `_check_lines`). Q6: springs keep a length
    (`_check_lines`).

    Args:
        system: The system, in doubles.
        exact_system: Builds the same in other numbers, from the numbers of its config.

    Raises:
        NotOnRotationsError: The energy depends on more, or is not known to be convex in the rest.
    """
    for element in system.elements:
        if element.from_user or not (element.smooth or isinstance(element, Ligament)):
            raise NotOnRotationsError(f"{element.name} is no element of the rotation alone")
    exact = exact_system(numbers)
    exact = replace(exact, elements=tuple(map(_without_angles, exact.elements)))
    held = system.coordinates.holds_contact
    _check_lines(exact, held=held)
    at_rest, motion = configurations(system), _motion(exact, held=held)
    total, taut = expr(0), dict[str, Expr | None]()
    for given, element in zip(at_rest.system.elements, exact.elements, strict=True):
        element_states = variables(state_numbers_of(at_rest, given))
        acting: Any = element
        if isinstance(element, Ligament):
            acting = with_steps(element, motion, element_states, 3)
            if element.damping > 0:
                taut[element.name] = (
                    expr(element.guards(motion, element_states)[0]) if held else None
                )
        _read_rotations_only(acting, motion, element_states)
        total = total + acting.stored(motion, element_states)
    try:
        reduced = eliminated(with_unit_steps(total), range(3, at_rest.size))
    except NoMinimumError as error:
        raise NotOnRotationsError(NO_POSITION) from error
    if reduced.free and not reduced.shift:
        raise NotOnRotationsError(NO_POSITION)
    return RotationEnergy(
        U=reduced.U,
        free=reduced.free,
        minimiser=reduced.minimiser,
        shift=reduced.shift,
        just_taut=taut,
    )


def _without_angles(element: Element) -> Element:
    """Return a stabilizer without K_r as the damper that it is, and any other element itself."""
    if not isinstance(element, RotationalStabilizer):
        return element
    if isinstance(element, OfAngles):
        raise NotOnRotationsError("the motor N acts on Euler angles")
    if any(K != 0 for K in element.K_r.flat):
        raise NotOnRotationsError("K_r acts on Euler angles")
    return AttitudeSpring(name=element.name, K=element.K_r, L=element.L_r)


def _motion(exact: System, *, held: bool) -> Motion:
    """Return a motion in variables, without Θ, B and a time."""
    A = variables(range(ENTRIES, ENTRIES + 9)).reshape(3, 3)
    Omega, V = (variables(range(RATES + 3 * k, RATES + 3 * k + 3)) for k in range(2))
    zero = np.array([expr(0)] * 3, dtype=object)
    if held:
        X = contact.centre_position(exact.body, A, zero, exact.anchor)
        V = contact.centre_velocity(exact.body, A, Omega, zero)
        E, F = zero, zero
    else:
        X = variables(range(3, 6))
        E = contact.displacement(exact.body, A, X, exact.anchor)
        F = contact.velocity(exact.body, A, Omega, V)
    unread: Any = None
    return Motion(unread, Omega, X, V, A, unread, E, F, unread)


def _read_rotations_only(element: Element, motion: Motion, element_states: Array) -> None:
    """Compute all that an element states; what it must not read raises."""
    try:
        element.wrench(motion, element_states)
        element.stored(motion, element_states)
        element.dissipated(motion, element_states)
        element.rates(motion, element_states)
    except (AttributeError, TypeError, ValueError) as error:  # None is no number
        why = f"{element.name} reads Euler angles or the time"
        raise NotOnRotationsError(why) from error


def _check_lines(exact: System, *, held: bool) -> None:
    """Refuse springs that may lose their length, or whose energy is not convex in X (Q3, Q6)."""
    c = exact.body.contact_point
    for element in exact.elements:
        if not isinstance(element, Spring):
            continue
        if not held:
            raise NotOnRotationsError(f"the energy of {element.name} is not convex in X")
        # A point p of a body that is held at its contact point c is at A(p - c) + c + X_a. Its
        # distance from an anchor a is never zero if |p - c| is not |a - c - X_a|, which is exact.
        arm, reach = element.point - c, element.anchor - c - exact.anchor
        if _square(arm) == _square(reach):
            raise NotOnRotationsError(f"{element.name} has no length at some rotation")


def _square(vector: Array) -> Fraction:
    square = expr(sum(x * x for x in vector.tolist())).constant
    assert square is not None
    return square
