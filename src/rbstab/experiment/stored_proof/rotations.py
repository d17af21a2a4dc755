"""Make the record of what is proved of the rest states among all rotations."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.experiment.stored_proof.proof import Proof, ProvedState
from rbstab.mechanics import contact
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

if TYPE_CHECKING:
    from rbstab.proof.rotations.energy import RotationEnergy
    from rbstab.proof.rotations.states import RestRotation, Rotations

COMPLETE = "all rest states among all rotations were found"
"""The outcome of a complete list."""

FAMILIES = "all rest states among all rotations were found; some form a continuum (a family)"
"""That of one with families."""

POLE = 1e-6
"""|cos θ2| below which θ1 and θ3 are not determined by the rotation."""


def rotations_record(
    identity: str,
    system: System,
    energy: "RotationEnergy",
    found: "Rotations",
    why_not: str,
) -> Proof:
    """Return what was proved as plain data.

    Args:
        identity: The id of the proof.
        system: The system, in doubles.
        energy: Its energy.
        found: The rest states: all of them, or all that are isolated.
        why_not: Why almost every start is not proved to converge to a stable one; else empty.
    """
    states = [_state(system, energy, state) for state in found.states]
    on_rotations = {
        "quaternions": [state.quaternion for state in found.states],
        "radii": [state.radius for state in found.states],
        "why": why_not,
        "families": [
            {"energy": one.energy, "index": one.index, "dimension": one.dimension}
            for one in found.families
        ],
    }
    return Proof.model_validate(
        {
            "id": identity,
            "outcome": COMPLETE if found.proved else FAMILIES,
            "proved": found.proved,
            "unique": (len(states) == 1) if found.proved else None,
            "examined": found.examined,
            "undecided": (),
            "states": states,
            "region": _region(found, states),
            "regions": _regions(found),
            "on_rotations": on_rotations,
        }
    )


def _state(system: System, energy: "RotationEnergy", state: "RestRotation") -> ProvedState:
    from rbstab.proof.rotations.lists import configuration_at

    placed = configuration_at(energy, state)
    A, held = state.rotation, system.coordinates.holds_contact
    if held:
        X = contact.centre_position(system.body, A, ZERO, system.anchor)
    else:
        X = np.array([placed.pop(k) for k in (3, 4, 5)])
    Theta = angles_of(A)
    entries = {
        "orientation": Theta,
        "position": X,
        "connector_state": [placed[k] for k in sorted(placed)],
        "energy": state.energy,
        "index": state.index,
        "proved": True,
        "enclosure": _enclosure(Theta, state.radius),
        "index_proved": True,
    }
    return ProvedState.model_validate(entries)


def angles_of(A: Array) -> Array:
    """Return Θ of a rotation, shape (3,), rad: θ2 in [-π/2, π/2], and θ3 = 0 where cos θ2 = 0."""
    cosine = math.hypot(A[0, 0], A[0, 1])
    pitch = math.atan2(A[0, 2], cosine)
    if cosine < POLE:
        return np.array([math.atan2(A[2, 1], A[1, 1]), pitch, 0.0])
    return np.array([math.atan2(-A[1, 2], A[2, 2]), pitch, math.atan2(-A[0, 1], A[0, 0])])


def _enclosure(Theta: Array, radius: float) -> tuple[Array, Array]:
    """Return a box of Θ that contains the rest state.

    Unit quaternions of two rotations with the angle φ between them are 2 sin(φ/4) apart, so φ is at
    most π times that; and |dΘ/dφ| <= 1/cos θ2. Where θ2 may be ±π/2, θ1 and θ3 are anything.
    """
    # With cos θ2 >= 4φ at Θ, it is more than half of that in the box.
    angle, cosine = 3.2 * radius + 1e-14, math.cos(Theta[1])
    if cosine < max(POLE, 4 * angle):
        Theta = np.array([0.0, Theta[1], 0.0])
        reach = np.array([math.pi, 2 * angle, math.pi])
    else:
        reach = np.full(3, 2 * angle / cosine)
    return Theta - reach, Theta + reach


def _region(found: "Rotations", states: list[ProvedState]) -> dict[str, Any] | None:
    """Return the region of the lowest rest state: all motions with less energy than any other."""
    if not found.states or found.states[0].index:
        return None
    lowest, others = found.states[0], found.states[1:]
    bounds = [state.low for state in others] + [family.low for family in found.families]
    bound = min(bounds, default=-math.inf)
    level = math.nextafter(bound - lowest.high, -math.inf)
    if not level > 0:
        return None
    place = next((k for k, state in enumerate(found.states) if state.low == bound), 0)
    return {
        "energy": bound,
        "level": level,
        "lower_bound": level,
        "attained_at": states[place].orientation,
        "face": None,
        "proved": True,
        "energy_bound": bound,
    }


def _regions(found: "Rotations") -> list[dict[str, Any]]:
    """Return the regions of all minima: components of {U < c}, each of which has one rest state."""
    regions: list[dict[str, Any]] = []
    for number, state in enumerate(found.states, start=1):
        depth = math.nextafter(found.level - state.high, -math.inf)
        if not state.index and depth > 0:
            entries = {"level": depth, "lower_bound": depth, "energy_bound": found.level}
            nowhere = dict.fromkeys(("pass_state", "pass_face", "pass_at"))
            regions.append({"rest_state": number, **entries, **nowhere})
    return regions
