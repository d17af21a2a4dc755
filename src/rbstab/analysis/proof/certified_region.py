"""The region in which the Lyapunov function proves convergence to the rest state.

v = U - U* plus kinetic energy never grows. So if a motion starts with v below the least U - U* on
the border of the range, it stays inside the range. If also no other rest state has such a low
U - U*, the motion converges to the rest state (La Salle).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np

from rbstab.analysis.proof.boxes import RANGE_END, Boxes, joined
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.least_value import LeastValue, least_value, lower_bounds, upper_bounds
from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.proof.rest_states import RestPoint, RestStates
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

FACE_BOX_LIMIT = 100_000

TIE_TOLERANCE = 1e-10
"""Energies with a smaller relative difference count as equal, such as on faces that are symmetric.

The first of several equal energies is reported, so the result is the same on every processor.
"""


class Face(Enum):
    """One end of the range of Θ: the axis and the sign of its angle."""

    THETA1_LOW = (0, -1)
    THETA1_HIGH = (0, 1)
    THETA2_LOW = (1, -1)
    THETA2_HIGH = (1, 1)
    THETA3_LOW = (2, -1)
    THETA3_HIGH = (2, 1)

    @property
    def box(self) -> Boxes:
        """The face of the range of eq. 5 as a box."""
        return self.box_of(RANGE_END)

    def box_of(self, end: Array) -> Boxes:
        """Return the face of the range -end <= Θ <= end as a box that is thin along its axis.

        π and π/2 are no doubles, so the box is not flat.
        """
        axis, sign = self.value
        low, high = -end, end.copy()
        outer, inner = sign * end[axis], sign * np.nextafter(end[axis], 0)
        low[axis], high[axis] = min(outer, inner), max(outer, inner)
        return Boxes(low[np.newaxis], high[np.newaxis])


def border_of(form: TrigonometricForm) -> list[Face]:
    """Return the faces that a motion may reach: none of an axis that a guard closes."""
    guard = form.guard
    return [face for face in Face if guard is None or not guard.closes(face.value[0])]


@dataclass(frozen=True, eq=False)
class CertifiedRegion:
    """The set {v < level}: every motion from it converges to the lowest rest state.

    energy, J, is c*, the least potential energy on the border of the range and at every other rest
    state. level, J, is c* minus the energy of the lowest rest state, so it is a value of v. If it
    is zero or negative, the region is empty.

    lower_bound, J, is the level up to which this is proved. It is near `level` if `proved`. It is
    lower if an undecided box may contain a rest state of lower energy, and 0 if nothing is proved.
    energy_bound, J, is the same bound for the total energy: a proved lower bound of c*, or None if
    nothing is proved.

    attained_at, shape (3,), rad, is the (first) point with energy c*: on `face`, or a rest state if
    `face` is None. faces has the least energy on each face.
    """

    energy: float
    level: float
    lower_bound: float
    energy_bound: float | None
    attained_at: Array
    face: Face | None
    faces: Mapping[Face, LeastValue]
    proved: bool


def certified_region(rest: RestStates, box_limit: int = FACE_BOX_LIMIT) -> CertifiedRegion | None:
    """Compute the region in which v proves convergence to the lowest rest state.

    Args:
        rest: The rest states of the system.
        box_limit: The number of boxes on one face at which the search stops.

    Returns:
        The region, or None if no rest state in the range is known, or if nothing bounds a region.
    """
    if not rest.states:
        return None
    form, (lowest, *others) = rest.energy.form, rest.states
    faces = {face: least_value(form, face.box_of(rest.end), box_limit) for face in border_of(form)}
    candidates: list[tuple[float, Array, Face | None]] = [
        (least.value, least.Theta, face) for face, least in faces.items()
    ]
    candidates += [(point.state.energy, point.Theta, None) for point in others]
    if not candidates:
        return None
    energy = min(candidate[0] for candidate in candidates)
    tie = TIE_TOLERANCE * max(abs(energy), abs(lowest.state.energy))
    _, attained_at, face = next(
        candidate for candidate in candidates if candidate[0] - energy <= tie
    )
    bound = _proved_bound(rest, faces.values())
    return CertifiedRegion(
        energy,
        energy - lowest.state.energy,
        0.0 if bound is None else _height(rest, bound),
        bound,
        attained_at,
        face,
        faces,
        rest.proved and all(least.closed for least in faces.values()),
    )


def _proved_bound(rest: RestStates, faces: Iterable[LeastValue]) -> float | None:
    """Return an energy below which lie neither the border nor any rest state but the lowest."""
    form, (lowest, *others) = rest.energy.form, rest.states
    is_minimum = lowest.proved and lowest.index_proved and lowest.index == 0
    if rest.outcome is SearchOutcome.SEARCHED or not is_minimum:
        return None
    places = joined([rest.undecided, *(point.enclosure for point in others)])
    inside = lower_bounds(enclosure(form, places))
    at_border = [least.lower_bound for least in faces]
    bound = min([*at_border, float(inside.min(initial=np.inf))])
    return bound if bound > -np.inf else None


def energy_at_most(form: TrigonometricForm, point: RestPoint) -> float:
    """Return an upper bound of the energy of a rest state, J: a proved minimum, or near it."""
    if point.state.on_kink:
        # At a stop, the rounded θ2 may be beyond the exact one, and U below that of the state.
        return float(upper_bounds(enclosure(form, point.enclosure))[0])
    found = form.rigorous(point.Theta[np.newaxis], 0)[0]
    return float(found.values[0] + found.error)


def _height(rest: RestStates, bound: float) -> float:
    """Return a lower bound of how far an energy is above the lowest rest state; 0 if below it."""
    height = bound - energy_at_most(rest.energy.form, rest.states[0])
    return max(0.0, float(np.nextafter(height, -np.inf)))
