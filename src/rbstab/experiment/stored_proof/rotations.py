"""Make the record of what is proved of the rest states among all rotations."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.experiment.stored_proof.entries import OnRotations, ProvedFamily
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.mechanics import contact
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.quaternion import POLE, sharp_angles
from rbstab.proof.entries import ProvedMinimum, ProvedRegion, ProvedState
from rbstab.systems.system import System

if TYPE_CHECKING:
    from rbstab.proof.rotations.energy import RotationEnergy
    from rbstab.proof.rotations.states import RestRotation, Rotations

COMPLETE = "all rest states among all rotations were found"
"""The outcome of a complete list."""

FAMILIES = (
    "all rest states among all rotations were found, but some form a continuum (a family), so a "
    "motion has no single one to come to"
)
"""That of one with families."""

NOWHERE: dict[str, Any] = dict.fromkeys(("pass_state", "pass_face", "pass_at"))
"""The pass of a region that is not located."""


def rotations_record(
    identity: str,
    system: System,
    energy: "RotationEnergy",
    rotations: "Rotations",
    why_not: str,
) -> Proof:
    """Return what was proved as plain data.

    Args:
        identity: The id of the proof.
        system: The system, in doubles.
        energy: Its energy.
        rotations: The rest states: all of them, or all that are isolated.
        why_not: Why almost every start is not proved to converge to a stable one; else empty.
    """
    states = tuple(_state(system, energy, state) for state in rotations.states)
    minima = [n for n, state in enumerate(rotations.states, start=1) if not state.index]
    depths = {n: _below(rotations.level - rotations.states[n - 1].high) for n in minima}
    return Proof(
        id=identity,
        outcome=COMPLETE if rotations.proved else FAMILIES,
        proved=rotations.proved,
        unique=(len(states) == 1) if rotations.proved else None,
        examined=rotations.examined,
        undecided=(),
        states=states,
        region=_region(rotations, states),
        # Each is a component of {U < c} with one rest state.
        regions=tuple(
            ProvedMinimum(
                rest_state=n,
                level=depth,
                lower_bound=depth,
                energy_bound=rotations.level,
                **NOWHERE,
            )
            for n, depth in depths.items()
            if depth > 0
        ),
        on_rotations=OnRotations(
            quaternions=tuple(state.quaternion for state in rotations.states),
            radii=tuple(state.radius for state in rotations.states),
            why=why_not,
            families=tuple(
                ProvedFamily(energy=family.energy, index=family.index, dimension=family.dimension)
                for family in rotations.families
            ),
        ),
    )


def _below(number: float) -> float:
    return math.nextafter(number, -math.inf)


def _state(system: System, energy: "RotationEnergy", state: "RestRotation") -> ProvedState:
    from rbstab.proof.rotations.lists import configuration_at

    placed, A = configuration_at(energy, state), state.rotation
    if system.coordinates.holds_contact:
        X = contact.centre_position(system.body, A, ZERO, system.anchor)
    else:
        X = np.array([placed.pop(k) for k in (3, 4, 5)])
    Theta = sharp_angles(state.quaternion[0], state.quaternion[1:])
    return ProvedState(
        orientation=Theta,
        position=X,
        connector_state=[placed[k] for k in sorted(placed)],
        energy=state.energy,
        index=state.index,
        proved=True,
        enclosure=_enclosure(Theta, state.radius),
        index_proved=True,
    )


def _enclosure(Theta: Array, radius: float) -> tuple[Array, Array]:
    """Return a box of Θ that contains the rest state."""
    # Unit quaternions of two rotations with the angle φ between them are 2 sin(φ/4) apart, so φ is
    # at most π times that; and |dΘ/dφ| <= 1/cos θ2. Where θ2 may be ±π/2, θ1 and θ3 are anything.
    # With cos θ2 >= 4φ at Θ, it is more than half of that in the box.
    angle, cosine = 3.2 * radius + 1e-14, math.cos(Theta[1])
    if cosine < max(POLE, 4 * angle):
        Theta = np.array([0.0, Theta[1], 0.0])
        reach = np.array([math.pi, 2 * angle, math.pi])
    else:
        reach = np.full(3, 2 * angle / cosine)
    return Theta - reach, Theta + reach


def _region(rotations: "Rotations", states: tuple[ProvedState, ...]) -> ProvedRegion | None:
    """Return the region of the lowest rest state: all motions with less energy than any other."""
    if not rotations.states or rotations.states[0].index:
        return None
    bounds = [s.low for s in rotations.states[1:]] + [f.low for f in rotations.families]
    bound = min(bounds, default=-math.inf)
    level = _below(bound - rotations.states[0].high)
    if not level > 0:
        return None
    place = next((k for k, state in enumerate(rotations.states) if state.low == bound), 0)
    return ProvedRegion(
        energy=bound,
        level=level,
        lower_bound=level,
        attained_at=states[place].orientation,
        face=None,
        proved=True,
        energy_bound=bound,
    )
