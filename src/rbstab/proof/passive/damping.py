"""Which motions lose energy: matrices that must be definite, and dampers of users.

A dissipated power of an element of a user is never negative (`passive.py`). Where it is zero, so
are the velocities of which it is seen to be squares and the like (`signs.vanishing`).
"""

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.analysis.exact import is_positive_definite, kernel
from rbstab.elements.at_point import AtPoint
from rbstab.elements.attitude_spring import AttitudeSpring
from rbstab.elements.element import Element
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.motors import Hard, Lagged, OfAngles
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.mechanics.algebra import IDENTITY, ZERO, cross_matrix
from rbstab.mechanics.numbers import Array
from rbstab.proof.exact.expr import Expr, expr
from rbstab.proof.exact.rewriting import substituted
from rbstab.proof.passive.passive import in_proofs, why_not_passive
from rbstab.proof.passive.signs import spanned, vanishing
from rbstab.proof.passive.statements import NotRecordedError, Statements, statements_of
from rbstab.systems.system import System

OF_ROTATION = {RotationalStabilizer: "L_r", AttitudeSpring: "L"}
"""The kinds of elements that dissipate Ω'LΩ, and the names of their L."""

OF_POINTS = {TranslationalStabilizer: "L_t", ViscoElasticConnector: "L_c", EmbeddedConnector: "L_c"}
"""Those that dissipate V'LV, or F'LF with the velocity F of a point of the body."""


NO_DAMPING = np.full((3, 3), Fraction(0))
"""Zeros that leave rational numbers exact in a sum: 0.0 would round them."""


class Damping(NamedTuple):
    """Which velocities are zero where elements dissipate nothing.

    Attributes:
        turning: Whether Ω is.
        moving: Whether V is, where Ω = 0.
    """

    turning: bool
    moving: bool


NOTHING = Damping(turning=False, moving=False)


def damping_of_users(system: System) -> Damping:
    """Return which motions the elements of users damp that do not switch, each by itself.

    It is nothing, if one of them is not in proofs.

    Args:
        system: The system, in doubles.
    """
    users = [element for element in system.elements if element.from_user]
    if not all(map(in_proofs, users)):
        return NOTHING
    at_rest, dampings = configurations(system), list[Damping]()
    for element in at_rest.system.elements:
        if not element.from_user or element.mode_count:
            continue
        try:
            statements = statements_of(at_rest, element)
        except NotRecordedError:
            return NOTHING
        if why_not_passive(statements):
            return NOTHING
        dampings.append(_damped(statements))
    return Damping(*(any(each) for each in zip(NOTHING, *dampings, strict=True)))


def _damped(statements: Statements) -> Damping:
    """Return whether Ω or AΩ, and V or A'V, are seen to be zero where nothing is dissipated."""
    motion, dissipated = statements.of_any.motion, statements.of_any.dissipated
    still = substituted(dissipated, {a: expr(0) for entry in motion.Omega for a in entry.atoms})
    return Damping(
        _vanish(dissipated, motion.Omega, motion.A @ motion.Omega),
        not statements.held and _vanish(still, motion.V, motion.A.T @ motion.V),
    )


def _vanish(dissipated: Expr, *velocities: Array) -> bool:
    zeros = vanishing(dissipated)
    return any(spanned([expr(entry) for entry in velocity], zeros) for velocity in velocities)


class _Dampers(NamedTuple):
    """The dampers of a body."""

    rotation: Array  # the sum of all L of Ω'LΩ, shape (3, 3)
    # For each point p of the body the sum of all L of F'LF, shape (3, 3), and their elements'
    # names.
    points: dict[tuple[Fraction, ...], tuple[Array, list[str]]]
    others: list[str]  # the names of the elements whose dissipation has another form


def why_not_damped(
    system: System, of_users: Damping = NOTHING, *, points_vary: bool = False
) -> str | None:
    """Return why it is not shown that every motion loses energy at every pose; None if it is.

    Let W = A'V. No dissipation is negative, so where their sum is zero each of them is:

        L Ω = 0          L: the sum of all L_r and of all L of attitude springs
        W + Ω × p = 0    for each point p at which the sum of all L_t and L_c is positive definite

    and W + Ω × c = 0 if the contact point c is held. The pose is not in these equations. If they
    leave Ω = 0 only, all points move with V, and V'(Σ L)V is left.

    Args:
        system: The system in rational numbers, with or without its elements of users.
        of_users: What these damp.
        points_vary: Whether the points of the body are not known.
    """
    dampers, held = _dampers(system), system.coordinates.holds_contact
    late = [element.name for element in system.elements if isinstance(element, Lagged)]
    if late and any(element.holds for element in system.elements):
        return f"the damping of {' and '.join(late)} lags, and no proof takes this beside a stop"
    rows = [np.hstack([NO_DAMPING, IDENTITY if of_users.turning else dampers.rotation])]
    points = dampers.points.items()
    counted = [p for p, (L, _) in points if is_positive_definite(L) and not points_vary]
    fixed = [*counted, *([system.body.contact_point] if held else [])]
    rows += [np.hstack([IDENTITY, -cross_matrix(np.array(p, dtype=object))]) for p in fixed]
    left = kernel(np.vstack(rows))
    turning = [rates for rates in left if any(rates[3:])]
    if turning:
        names = [name for p, (_, some) in points if p not in counted for name in some]
        nothing = len(left) == 6 - 3 * held
        motion = "the body" if nothing else _rotation(*np.split(turning[0], 2), held=held)
        return _reason(motion, [*names, *dampers.others]) + _singular(system)
    of_points = sum((L for _, (L, _) in points), NO_DAMPING)
    free = [] if held or of_users.moving else kernel(of_points)
    along = "" if len(free) > 1 else f" along {_direction(free[0])}" if free else ""
    return _reason(f"a translation{along}", dampers.others) + _singular(system) if free else None


def _dampers(system: System) -> _Dampers:
    rotation, others = NO_DAMPING, list[str]()
    points: dict[tuple[Fraction, ...], tuple[Array, list[str]]] = {}
    for element in system.elements:
        of_rotation, of_point = (
            [_damper(element, L) for kind, L in kinds.items() if isinstance(element, kind)]
            for kinds in (OF_ROTATION, OF_POINTS)
        )
        # The rates of Euler angles are all zero where Ω is, but their axes turn. Beyond a hard
        # limit nothing is dissipated.
        turns = isinstance(element, OfAngles) and not is_positive_definite(of_rotation[0])
        if turns or isinstance(element, Hard):
            others.append(element.name)
        elif of_rotation:
            rotation = rotation + of_rotation[0]
        elif of_point and np.any(of_point[0] != 0):
            p = tuple(_point_of(element, system))
            L, names = points.get(p, (NO_DAMPING, []))
            points[p] = L + of_point[0], [*names, element.name]
        elif not of_point and _may_dissipate(element):
            others.append(element.name)
    return _Dampers(rotation, points, others)


def _damper(element: Element, L: str) -> Array:
    """Return a damping matrix."""
    # That of a motor with a lag is D: where it dissipates z'Dz = 0 for a while, z = 0, and so is u.
    return element.left if isinstance(element, Lagged) else getattr(element, L)


def _may_dissipate(element: Element) -> bool:
    return type(element).dissipated is not Element.dissipated and getattr(element, "damping", 1) > 0


def _point_of(element: Element, system: System) -> Array:
    if isinstance(element, TranslationalStabilizer):
        return ZERO
    return element.point if isinstance(element, AtPoint) else system.body.contact_point


def _reason(motion: str, others: list[str]) -> str:
    """Return the reason, with the elements that may act on a motion, but need not in each pose."""
    if not others:
        return f"no damper acts on {motion}"
    return f"only {' and '.join(others)} may damp {motion}, and perhaps not at every pose"


def _singular(system: System) -> str:
    """Return which dampings are singular, or end at a hard limit, as the end of a reason."""
    if any(isinstance(element, Hard) for element in system.elements):
        return " (beyond a hard limit nothing is damped; a motor with law: smooth damps everywhere)"
    stabilizers = (TranslationalStabilizer, RotationalStabilizer)
    gains = [
        f"{gain.name} is {'singular' if np.any(getattr(element, gain.name) != 0) else '0'}"
        for element in system.elements
        if isinstance(element, stabilizers)
        for gain in element.gains
        if gain.dissipates and not is_positive_definite(getattr(element, gain.name))
    ]
    return f" ({' and '.join(gains)})" if gains else ""


def _rotation(W: Array, Omega: Array, *, held: bool) -> str:
    """Return a rotation in words, with a point of its axis that is not G, nor held."""
    axis = np.cross(Omega, W) / (Omega @ Omega)
    through = f" through {_numbers(axis)} m" if any(axis) and not held else ""
    return f"a rotation about body {_direction(Omega)}{through}"


def _direction(vector: Array) -> str:
    """Return the name of an axis, or the components of another direction."""
    axes = [name for name, entry in zip("xyz", vector, strict=True) if entry]
    return axes[0] if len(axes) == 1 else _numbers(vector / max(vector, key=abs))


def _numbers(vector: Array) -> str:
    return "(" + ", ".join(f"{float(entry):.4g}" for entry in vector) + ")"


def indefinite_parameter(system: System) -> str | None:
    """Return the name of a parameter that is not definite; None if all of them are.

    The mass, the inertia and the dampings of own states must be positive definite, so that the
    kinetic energy is a norm of the velocities; other dampings need only be semidefinite, as
    `why_not_damped` checks their sum. The stiffness of X and D is checked where these are
    eliminated (`model.py`).

    Args:
        system: The system in rational numbers, or in doubles, which are taken as exact.
    """
    if not Fraction(system.body.mass) > 0:
        return "mass"
    if not is_positive_definite(system.body.inertia):
        return "inertia"
    summed = {*OF_ROTATION.values(), *OF_POINTS.values()}
    for element in system.elements:
        # That elements of users never dissipate less than nothing is another question
        # (`passive.py`).
        if isinstance(element, Lagged) and not is_positive_definite(element.left):
            return "L - τK of a motor with a lag"
        for gain in () if element.from_user else element.gains:
            L, or_semi = getattr(element, gain.name), gain.name in summed
            if gain.dissipates and not is_positive_definite(L, or_semi=or_semi):
                return gain.name
    return None
