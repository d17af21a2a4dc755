"""The region in which the Lyapunov function proves convergence to the rest state.

v = U - U* plus kinetic energy never grows. So a motion that starts with v below the least U - U* on
the border of the range stays inside the range; if no other rest state has U - U* that low either,
it must come to the rest state (La Salle).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np

from rbstab.analysis.proof.boxes import RANGE_END, Boxes, joined
from rbstab.analysis.proof.branch_and_bound import Outcome
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.least_value import LeastValue, least_value, lower_bounds
from rbstab.analysis.proof.rest_states import RestStates
from rbstab.mechanics.numbers import Array

FACE_BOX_LIMIT = 100_000

ALIKE = 1e-10
"""Relative: of energies that differ by no more, as those of opposite faces under symmetry, the
first counts, on every processor."""


class Face(Enum):
    """One end of the range of eq. 5: the axis and the sign of its angle."""

    THETA1_LOW = (0, -1)
    THETA1_HIGH = (0, 1)
    THETA2_LOW = (1, -1)
    THETA2_HIGH = (1, 1)
    THETA3_LOW = (2, -1)
    THETA3_HIGH = (2, 1)

    @property
    def box(self) -> Boxes:
        """The face as a box that is thin along its axis: it holds the end, which is no double."""
        axis, sign = self.value
        low, high = -RANGE_END, RANGE_END.copy()
        outer, inner = sign * RANGE_END[axis], sign * np.nextafter(RANGE_END[axis], 0)
        low[axis], high[axis] = min(outer, inner), max(outer, inner)
        return Boxes(low[np.newaxis], high[np.newaxis])


@dataclass(frozen=True, eq=False)
class CertifiedRegion:
    """The set {v < level}, of which all converges to the lowest rest state.

    energy, J, is c*, the least potential energy on the border of the range and at every other rest
    state; level, J, is c* less the energy of the lowest rest state, and so a value of v. Where it
    is zero or less the region is empty.

    lower_bound, J, is the level up to which this is proved: near `level` where `proved`, less where
    what is undecided might hold a rest state of less energy, and 0 where nothing is proved.

    attained_at, shape (3,), rad, is where c* is, or the first such place: on `face`, or at a rest
    state if that is None. faces has the least energy on each face.
    """

    energy: float
    level: float
    lower_bound: float
    attained_at: Array
    face: Face | None
    faces: Mapping[Face, LeastValue]
    proved: bool


def certified_region(rest: RestStates, box_limit: int = FACE_BOX_LIMIT) -> CertifiedRegion | None:
    """The region in which v proves convergence to the lowest rest state.

    Args:
        rest: The rest states of the system.
        box_limit: The number of boxes on one face at which to give up.

    Returns:
        The region, or None where the range has no known rest state.
    """
    if not rest.states:
        return None
    form, (lowest, *others) = rest.energy.form, rest.states
    faces = {face: least_value(form, face.box, box_limit) for face in Face}
    ends: list[tuple[float, Array, Face | None]] = [
        (least.value, least.Theta, face) for face, least in faces.items()
    ]
    ends += [(point.state.energy, point.Theta, None) for point in others]
    energy = min(end[0] for end in ends)
    alike = ALIKE * max(abs(energy), abs(lowest.state.energy))
    _, attained_at, face = next(end for end in ends if end[0] - energy <= alike)
    return CertifiedRegion(
        energy,
        energy - lowest.state.energy,
        _proved_level(rest, faces.values()),
        attained_at,
        face,
        faces,
        rest.proved and all(least.closed for least in faces.values()),
    )


def _proved_level(rest: RestStates, faces: Iterable[LeastValue]) -> float:
    """A level below which v meets neither the border nor a rest state other than the lowest."""
    if rest.outcome is Outcome.SEARCHED:
        return 0.0
    form, (lowest, *others) = rest.energy.form, rest.states
    places = joined([rest.undecided, *(point.enclosure for point in others)])
    inside = lower_bounds(enclosure(form, places))
    at_border = [least.lower_bound for least in faces]
    reached = min([*at_border, float(inside.min(initial=np.inf))])
    found = form.rigorous(lowest.Theta[np.newaxis], 0)[0]
    # The lowest rest state has at most this energy, so v there is counted from no more.
    level = reached - float(found.values[0] + found.error)
    return max(0.0, float(np.nextafter(level, -np.inf)))
