"""The energies of the rest states, faces and undecided boxes of a range, and its first cells."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box, Boxes, joined, one_box
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.enclosures.levels import Ranges, least_values
from rbstab.proof.enclosures.tied import without_lengths
from rbstab.proof.model import Energy
from rbstab.proof.regions.passes import Complex, Face, Land, parts_of
from rbstab.proof.search import Zeros
from rbstab.proof.zeros import Zero

LIMIT = 16_000
"""Cells of one range."""

AT_ONCE = 300
"""Cells that are divided at once, the largest first: others may then be on no way any more."""

PITCH = 1
"""The axis of θ2."""


@dataclass(frozen=True, eq=False)
class Level:
    """An energy at which a region may end: its proved bound, about its value, and where it is."""

    bound: float
    value: float
    at: Array | None = None
    state: int | None = None
    face: Face | None = None


def open_faces(box: Box, open_axes: Sequence[int]) -> list[tuple[Face, Boxes]]:
    """Return the faces of a range as boxes, as thick as one double: π and π/2 are none."""
    return [(one.face, one.boxes) for one in parts_of(box, open_axes, one_box(box))]


def is_minimum(zero: Zero) -> bool:
    """Return whether a zero is proved to be a minimum."""
    return zero.index == 0 and not zero.ridge


class Landscape:
    """The energies of rest states, faces and undecided boxes of a range."""

    def __init__(
        self, energy: Energy, zeros: Zeros, box: Box, V: Ranges, *, confining: bool = False
    ) -> None:
        self.V, self.box, self.zeros, self.examined = V, box, zeros, 0
        states = [zero.enclosure for zero in zeros.zeros]
        self.at_zeros = V.values(joined([one_box(state) for state in states], 3))
        open_axes = [axis for axis in range(3) if axis not in energy.closed]
        self.land = Land(V, box, open_axes, states, self.at_zeros.lo)
        undecided = V.values(zeros.undecided)
        lowest = float(undecided.lo.min(initial=np.inf))
        self.springs = self._spring_levels(without_lengths(energy))
        self.cap = min([lowest, *(one.bound for one in self.springs)])
        self.confining = confining and not self.springs

    def _spring_levels(self, collapsed: Sequence[BoundedEnergy]) -> list[Level]:
        """Return the least energies where a spring has no length, as far as they are the lowest."""
        highest = min((one.value for one in self.face_levels), default=np.inf) if collapsed else 0.0
        found = [least_values(Ranges(one), one_box(self.box), cap=highest) for one in collapsed]
        return [Level(float(x.bound[0]), float(x.value[0]), x.at[:, 0]) for x in found]

    @cached_property
    def faces(self) -> list[tuple[Face, Boxes]]:
        """The open faces as boxes."""
        return open_faces(self.box, self.land.open_axes)

    def state_levels(self) -> list[Level]:
        """Return the levels of all rest states."""
        return [
            Level(float(self.at_zeros.lo[k]), zero.energy, zero.point, state=k)
            for k, zero in enumerate(self.zeros.zeros)
        ]

    @cached_property
    def face_levels(self) -> list[Level]:
        """The level of each open face."""
        return self._levels_of(self.faces)

    @cached_property
    def lowest_face_levels(self) -> list[Level]:
        """The levels of the faces at which the component of the lowest state may end.

        If all rest states are confined to the range, those of θ1 and θ3 are none: beyond them V has
        no rest state, also along θ2 = ±π/2, and rises without end. So each component of a set
        {V < c} below all other levels has a minimum of V, and there is one.
        """
        if sum(map(is_minimum, self.zeros.zeros)) < 2:  # no other pass is wanted
            return self._levels_of([one for one in self.faces if self._counts(one[0])], of_all=True)
        return [one for one in self.face_levels if one.face is not None and self._counts(one.face)]

    def _counts(self, face: Face) -> bool:
        return face[0] == PITCH or not self.confining

    def _levels_of(
        self, faces: Sequence[tuple[Face, Boxes]], *, of_all: bool = False
    ) -> list[Level]:
        if not faces:
            return []
        parts = joined([one for _, one in faces], 3)
        least = least_values(self.V, parts, of_all=of_all)
        self.examined += least.examined
        rows = zip(faces, least.bound, least.value, least.at.T, strict=True)
        return [Level(float(b), float(v), at, face=face) for (face, _), b, v, at in rows]

    def is_pass(self, level: Level) -> bool:
        """Return whether a level can be one at which a component reaches something else."""
        return level.state is None or not is_minimum(self.zeros.zeros[level.state])

    def is_ridge(self, level: Level) -> bool:
        """Return whether a level is that of a state on a ridge."""
        return level.state is not None and self.zeros.zeros[level.state].ridge

    @cached_property
    def cells(self) -> Complex:
        """The cells at first."""
        return Complex.of(self.land)

    def floor(self, minimum: int) -> float:
        """Return an upper bound of V at a minimum."""
        return float(self.at_zeros.hi[minimum])

    def cells_up_to(self, minimum: int, level: float) -> Complex:
        """Return cells that prove a level of a minimum, if `LIMIT` is enough for it."""
        cells = self.cells
        while cells.count < LIMIT:
            some = cells.ways(minimum, level).open
            if not len(some):
                break
            cells = divided(cells, some)
        return cells


def divided(cells: Complex, some: Array) -> Complex:
    """Divide the largest of some cells."""
    largest_first = np.argsort(cells.cells.depth[some], kind="stable")
    return cells.divided(some[largest_first][:AT_ONCE])
