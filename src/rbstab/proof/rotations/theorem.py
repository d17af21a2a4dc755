"""Theorem 15: almost every start of a body without Euler angles ends in a stable rest state.

Its hypotheses, and the functions that check them: Q1 `why_indefinite`; Q2, Q3 and the lengths of
springs in Q6 `rotation_energy`; Q4 `why_not_damped_on_rotations`; Q5 `Rotations.proved`, with
`against_morse`; the ligaments of Q6 `why_just_taut`.
"""

from collections.abc import Iterator

from rbstab.analysis.exact import is_positive_definite
from rbstab.elements.at_point import AtPoint
from rbstab.elements.attitude_spring import AttitudeSpring
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.gravity import Gravity
from rbstab.elements.inputs.loads import ConstantForce
from rbstab.elements.motors import Lagged
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.mechanics.algebra import cross
from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.exact.expr import Expr
from rbstab.proof.passive.damping import indefinite_parameter, why_not_damped
from rbstab.proof.rotations.energy import RotationEnergy
from rbstab.proof.rotations.forms import in_chart
from rbstab.proof.rotations.states import FAMILIES, RestRotation, Rotations
from rbstab.systems.system import System


def why_not_almost_every_start(energy: RotationEnergy, rotations: Rotations, exact: System) -> str:
    """Return the first hypothesis of theorem 15 that is not known to hold; "" if all hold.

    Args:
        energy: The energy: Q2, Q3 and a part of Q6.
        rotations: The rest states.
        exact: The system in rational numbers.
    """
    return next(_failing(energy, rotations, exact), "")


def _failing(energy: RotationEnergy, rotations: Rotations, exact: System) -> Iterator[str]:
    for why in (why_indefinite(exact), why_not_damped_on_rotations(exact)):
        if why is not None:
            yield why
    if rotations.why:
        yield rotations.why
    if rotations.families:
        yield from _why_families_matter(rotations, exact)
    yield from why_just_taut(energy, rotations)


def _why_families_matter(rotations: Rotations, exact: System) -> Iterator[str]:
    """Yield why part (c) of theorem 15 does not hold: a quadratic form with families."""
    if any(not family.index for family in rotations.families):
        yield f"{FAMILIES}, and the lowest are one"
    undamped = why_not_damped(exact)
    if undamped is not None:
        yield f"{FAMILIES}, and {undamped}"


def why_indefinite(exact: System) -> str | None:
    """Return which of m, J, the L_d and the other dampings is not definite (Q1); None if none."""
    name = indefinite_parameter(exact)
    return None if name is None else f"{name} is not positive definite"


def why_not_damped_on_rotations(exact: System) -> str | None:
    """Return why a motion may go on without losing energy (Q4); None if none does.

    Either dissipation vanishes only where Ω, V and all Ḋ do: (i) what damps Ω and a damped point,
    or (ii) three damped points that are not on one line, are cases of `why_not_damped`. Or (iii)
    two points of ties are fixed wherever it vanishes, and the body cannot turn about their line
    (`_two_ties_are_enough`).
    """
    undamped = why_not_damped(exact)
    return None if undamped is None or _two_ties_are_enough(exact) else undamped


def _two_ties_are_enough(exact: System) -> bool:
    """Return whether (iii) holds: weights and damped ties alone, two with G off their line."""
    if exact.coordinates.holds_contact:
        return False
    points = list[Array]()
    for element in exact.elements:
        if isinstance(element, (ViscoElasticConnector, EmbeddedConnector)):
            if isinstance(element, Lagged) or not is_positive_definite(element.L_c):
                return False
            place = element.point if isinstance(element, AtPoint) else exact.body.contact_point
            points.append(place)
        elif isinstance(element, TranslationalStabilizer):
            if any(k != 0 for k in element.K_t.flat):
                return False
        elif not isinstance(
            element, (Gravity, ConstantForce, AttitudeSpring, RotationalStabilizer)
        ):
            return False
    # Where nothing is dissipated for a while, the points of all ties are fixed, so all forces are
    # constant. X is bounded, and a quadratic function of the time: G is fixed as well.
    return any(any(cross(p, q)) for p in points for q in points)


def why_just_taut(energy: RotationEnergy, rotations: Rotations) -> Iterator[str]:
    """Yield which damped ligaments may be just taut, ε = 0, at a state of index >= 1 (Q6)."""
    for name, strain in energy.just_taut.items():
        for state in rotations.states:
            if state.index and (strain is None or _may_vanish(strain, state)):
                yield f"{name} may be just taut at an unstable rest state"


def _may_vanish(e: Expr, state: RestRotation) -> bool:
    """Return whether a function of A may be zero somewhere in the enclosure of a state."""
    assert state.zero is not None
    low, high = state.zero.enclosure
    value = BoundedEnergy(in_chart(e, state.chart), order=2).over(low[:, None], high[:, None])
    return not (value.value_over.lo[0] > 0 or value.value_over.hi[0] < 0)
