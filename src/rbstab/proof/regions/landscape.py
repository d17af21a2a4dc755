"""The energies of the rest states, faces and undecided boxes of a range, and of parts of it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.proof.boxes import Box, Boxes, as_boxes, joined
from rbstab.proof.enclosures.levels import Ranges, least_values
from rbstab.proof.enclosures.tied import without_lengths
from rbstab.proof.model import Energy
from rbstab.proof.search import Zeros
from rbstab.proof.zeros import Zero

Face = tuple[int, int]
"""An axis and the sign of its angle."""


class Parts(NamedTuple):
    """The parts of a face of a range that some boxes have: the face, which boxes, and the parts."""

    face: Face
    places: Array
    boxes: Boxes


@dataclass(frozen=True, eq=False)
class Level:
    """An energy at which a region may end: its proved bound, about its value, and where it is."""

    bound: float
    value: float
    at: Array | None = None
    state: int | None = None
    face: Face | None = None

    def distance(self, place: Box) -> float:
        """Return its distance from a place, along one axis; infinite if it has no place."""
        if self.at is None:
            return np.inf
        return float(np.maximum(place.lo - self.at, self.at - place.hi).max())


def parts_of(box: Box, axes: Sequence[int], boxes: Boxes) -> Iterator[Parts]:
    """Yield the parts of faces that boxes have, as thick as one double: π and π/2 are none.

    Args:
        box: The range.
        axes: The axes of the faces.
        boxes: Boxes in the range.
    """
    for axis in axes:
        for sign, end in ((-1, box.lo[axis]), (1, box.hi[axis])):
            places = np.flatnonzero((boxes.lo if sign < 0 else boxes.hi)[axis] == end)
            lo, hi = boxes.lo[:, places], boxes.hi[:, places]
            inner = np.nextafter(end, -sign * np.inf)
            lo[axis], hi[axis] = min(end, inner), max(end, inner)
            yield Parts((axis, sign), places, Boxes(lo, hi))


def open_faces(box: Box, open_axes: Sequence[int]) -> list[tuple[Face, Boxes]]:
    """Return the faces of a range as boxes."""
    return [(part.face, part.boxes) for part in parts_of(box, open_axes, as_boxes(box))]


def is_minimum(zero: Zero) -> bool:
    """Return whether a zero is proved to be a minimum."""
    return zero.index == 0 and not zero.ridge


class Landscape:
    """The energies of rest states, faces, undecided boxes, and of any boxes of a range.

    Args:
        energy: The energy.
        zeros: The rest states in the range, in the order of V.
        box: The range; the doubles at its ends are not inside the exact one.
        V: Bounds on the energy.
        confining: Whether theorem 6 confines all rest states to the range.
    """

    def __init__(
        self, energy: Energy, zeros: Zeros, box: Box, V: Ranges, *, confining: bool = False
    ) -> None:
        self.V, self.box, self.zeros = V, box, zeros
        self.open_axes = [axis for axis in range(3) if axis not in energy.closed]
        self.states = [zero.enclosure for zero in zeros.zeros]
        self.at_zeros = V.values(joined([as_boxes(state) for state in self.states], 3))
        collapsed = without_lengths(energy)
        self.confining = confining and not collapsed
        highest = (
            min((level.value for level in self.face_levels), default=np.inf) if collapsed else 0.0
        )
        least = [least_values(Ranges(bounded), as_boxes(box), cap=highest) for bounded in collapsed]
        # Where a spring has no length, as far as this is the lowest.
        self.springs = [Level(float(x.bound[0]), float(x.value[0]), x.at[:, 0]) for x in least]
        lowest = float(V.values(zeros.undecided).lo.min(initial=np.inf))
        self.cap = min([lowest, *(level.bound for level in self.springs)])

    @cached_property
    def minima(self) -> list[int]:
        """The numbers of the rest states that are proved to be minima."""
        return [k for k, zero in enumerate(self.zeros.zeros) if is_minimum(zero)]

    @cached_property
    def state_levels(self) -> list[Level]:
        """The levels of all rest states."""
        return [
            Level(float(self.at_zeros.lo[k]), zero.energy, zero.point, state=k)
            for k, zero in enumerate(self.zeros.zeros)
        ]

    @cached_property
    def face_levels(self) -> list[Level]:
        """The level of each open face; for one minimum, of those at which its region may end."""
        faces, single_minimum = open_faces(self.box, self.open_axes), len(self.minima) < 2
        if single_minimum:
            faces = [(face, boxes) for face, boxes in faces if self._ends_lowest(face)]
        least = least_values(
            self.V, joined([boxes for _, boxes in faces], 3), of_all=single_minimum
        )
        rows = zip(faces, least.bound, least.value, least.at.T, strict=True)
        return [Level(float(b), float(v), at, face=face) for (face, _), b, v, at in rows]

    @property
    def lowest_face_levels(self) -> list[Level]:
        """The levels of the faces at which the component of the lowest state may end."""
        return [level for level in self.face_levels if level.face and self._ends_lowest(level.face)]

    def _ends_lowest(self, face: Face) -> bool:
        """Return whether the component of the lowest state may end at a face."""
        # If all rest states are confined to the range, it does not at those of θ1 and θ3: beyond
        # them V has no rest state, also along θ2 = ±π/2, and rises without end. So each component
        # of a set {V < c} below all other levels has a minimum of V, and there is one.
        return face[0] == PITCH or not self.confining

    def is_pass(self, level: Level) -> bool:
        """Return whether a level can be one at which a component reaches something else."""
        return level.state is None or level.state not in self.minima

    def is_ridge(self, level: Level) -> bool:
        """Return whether a level is that of a state on a ridge."""
        return level.state is not None and self.zeros.zeros[level.state].ridge

    def floor(self, minimum: int) -> float:
        """Return an upper bound of V at a minimum."""
        return float(self.at_zeros.hi[minimum])

    def faces(self, boxes: Boxes) -> list[Parts]:
        """Return the parts of open faces that boxes have."""
        return [part for part in parts_of(self.box, self.open_axes, boxes) if part.boxes.count]

    def bounds(self, boxes: Boxes) -> Array:
        """Return numbers that only rise for parts of boxes, shape (3, boxes), J.

        They are lower bounds of V, lower bounds of -V, and those of V on the parts of open faces
        that a box has; these are infinite without one.
        """
        at_ends, n = self.faces(boxes), boxes.count
        values = self.V.values(joined([boxes, *(part.boxes for part in at_ends)], 3))
        ends, begin = np.full(n, np.inf), n
        for part in at_ends:
            low = values.lo[begin : begin + part.boxes.count]
            ends[part.places] = np.minimum(ends[part.places], low)
            begin += part.boxes.count
        return np.stack([values.lo[:n], -values.hi[:n], ends])

    def touching(self, boxes: Boxes) -> Array:
        """Return which boxes touch the enclosure of which rest state, shape (states, boxes)."""
        touches = np.array([boxes.touch(state) for state in self.states], dtype=bool)
        return touches.reshape(len(self.states), boxes.count)
