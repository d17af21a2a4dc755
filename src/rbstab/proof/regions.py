"""c*, below which all motions approach the lowest rest state, and the region of each minimum.

c* is the least energy on the open faces of the range, at all other rest states, and in undecided
boxes: {V < c*} contains the lowest rest state alone. The region of any minimum is the component of
{V < level} about it, for the highest level of which a flood proves that it reaches nothing else.
The levels tried are the energies of the other rest states and the least ones of faces, or of the
parts of faces that a flood reaches: one of these is the pass at which the component leaves.

Hypotheses: `Zeros` has all rest states of the range but those in its undecided boxes, also those
that a stop holds; a motion does not reach the ends of closed axes (`Energy.closed`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.bounds import BoundedEnergy
from rbstab.proof.flood import LIMIT, Flooded, Land, Outcome, flood
from rbstab.proof.levels import LeastValues, Ranges, least_values
from rbstab.proof.model import Energy
from rbstab.proof.search import Box, Boxes, Zero, Zeros, joined, one_box
from rbstab.proof.tied import without_lengths

TIE = 1e-10
"""Energies with a smaller relative difference count as equal; the first place is reported."""

MARGINS = (1e-6, 1e-3)
"""How far below a pass a flood is tried, relative to its height: very near it takes small cells."""

RIDGE_MARGINS = (0.01, 0.018)
"""The same for a pass on a ridge, whose walls are thin: they take cells all along the ridge."""

SMALLEST_GAIN = 1e-3
"""Levels that are higher by a smaller share of the height are not tried."""

BISECTIONS = 4
"""Levels that are tried where none of those of a place holds."""

Face = tuple[int, int]
"""An axis and the sign of its angle."""


@dataclass(frozen=True, eq=False)
class Certified:
    """The set {v < level}, from which every motion approaches the lowest rest state.

    Args:
        energy: c*, J, near where it is attained.
        level: c* above the energy of the lowest rest state, J.
        lower_bound: The level up to which this is proved, J; 0 if nothing is.
        energy_bound: The same for the sum of all energies; None if nothing is proved.
        attained_at: The first point with energy c*, shape (3,), rad.
        face: The face on which it is; None: at another rest state, or with a spring.
        spring: Whether it is where a spring has no length.
        closed: Whether the least energies on the faces are known to `levels.LOOSE`.
        examined: The number of boxes of faces.
    """

    energy: float
    level: float
    lower_bound: float
    energy_bound: float | None
    attained_at: Array
    face: Face | None
    closed: bool
    examined: int
    spring: bool = False


@dataclass(frozen=True, eq=False)
class Region:
    """The region of a minimum: each motion approaches it that is once in it with less energy.

    Args:
        state: The place of the minimum among the zeros.
        level: The height of its pass, J, about.
        lower_bound: The proved height, J.
        energy_bound: The level of the component, J.
        pass_state: The rest state that is the pass; None if it is none.
        pass_face: The face on which the pass is; None if it is on none.
        pass_at: Θ of the pass, shape (3,); None if it is not located.
        flooded: The flood that proves it; None if {V < energy_bound} has no other component.
        examined: The number of cells of all floods.
    """

    state: int
    level: float
    lower_bound: float
    energy_bound: float
    pass_state: int | None
    pass_face: Face | None
    pass_at: Array | None
    flooded: Flooded | None
    examined: int


@dataclass(frozen=True, eq=False)
class Regions:
    """The regions in a range; `certified` is None without a rest state, or if nothing bounds it."""

    certified: Certified | None
    minima: tuple[Region, ...]


NO_REGIONS = Regions(None, ())
"""Nothing is known."""


@dataclass(frozen=True, eq=False)
class _Level:
    """An energy at which a region may end: its proved bound, about its value, and where it is."""

    bound: float
    value: float
    at: Array | None = None
    state: int | None = None
    face: Face | None = None


def open_faces(box: Box, open_axes: Sequence[int]) -> list[tuple[Face, Boxes]]:
    """Return the faces of a range as boxes, as thick as one double: π and π/2 are none."""
    found = []
    for axis, sign in product(open_axes, (-1, 1)):
        lo, hi = box.lo.astype(float).copy(), box.hi.astype(float).copy()
        end = (lo if sign < 0 else hi)[axis]
        inner = np.nextafter(end, -sign * np.inf)
        lo[axis], hi[axis] = min(end, inner), max(end, inner)
        found.append(((axis, sign), one_box(Box(lo, hi))))
    return found


def is_minimum(zero: Zero) -> bool:
    """Return whether a zero is proved to be a minimum."""
    return zero.index == 0 and not zero.ridge


class Landscape:
    """The energies of rest states, faces and undecided boxes of a range."""

    def __init__(self, energy: Energy, zeros: Zeros, box: Box, V: Ranges) -> None:
        self.V, self.box, self.zeros = V, box, zeros
        self.open_axes = [axis for axis in range(3) if axis not in energy.closed]
        places = joined([one_box(zero.enclosure) for zero in zeros.zeros], 3)
        self.at_zeros = V.values(places)
        undecided = float(V.values(zeros.undecided).lo.min(initial=np.inf))
        self.springs = self._spring_levels(without_lengths(energy))
        self.cap = min([undecided, *(one.bound for one in self.springs)])

    def _spring_levels(self, collapsed: Sequence[BoundedEnergy]) -> list["_Level"]:
        """Return the least energies where a spring has no length, as far as they are the lowest."""
        highest = (
            min((one.value for one in self.face_levels()), default=np.inf) if collapsed else 0.0
        )
        found = [least_values(Ranges(one), one_box(self.box), cap=highest) for one in collapsed]
        return [_Level(float(x.bound[0]), float(x.value[0]), x.at[:, 0]) for x in found]

    @cached_property
    def faces(self) -> list[tuple[Face, Boxes]]:
        """The open faces as boxes."""
        return open_faces(self.box, self.open_axes)

    @cached_property
    def least(self) -> LeastValues | None:
        """The least energies on the open faces; None without one."""
        parts = joined([one for _, one in self.faces], 3)
        return least_values(self.V, parts) if parts.count else None

    def state_levels(self) -> list[_Level]:
        """Return the levels of all rest states."""
        return [
            _Level(float(self.at_zeros.lo[k]), zero.energy, zero.point, state=k)
            for k, zero in enumerate(self.zeros.zeros)
        ]

    def face_levels(self) -> list[_Level]:
        """Return the level of each open face."""
        if self.least is None:
            return []
        rows = zip(self.faces, self.least.bound, self.least.value, self.least.at.T, strict=True)
        return [_Level(float(b), float(v), at, face=face) for (face, _), b, v, at in rows]

    def is_pass(self, level: _Level) -> bool:
        """Return whether a level can be one at which a component reaches something else."""
        return level.state is None or not is_minimum(self.zeros.zeros[level.state])

    @cached_property
    def land(self) -> Land:
        """The cells with which each flood begins."""
        return Land(self.V, self.box, self.open_axes)

    def low(self, minimum: int, level: float) -> list[Box]:
        """Return the enclosures of other rest states that are not proved to be above a level."""
        return [
            zero.enclosure
            for k, zero in enumerate(self.zeros.zeros)
            if k != minimum and not self.at_zeros.lo[k] >= level
        ]

    def flood(self, minimum: int, level: float, near: Array | None, limit: int = LIMIT) -> Flooded:
        """Flood up to a level about a minimum, with small cells near a pass."""
        start, low = self.zeros.zeros[minimum].enclosure, self.low(minimum, level)
        high = [
            zero.point for k, zero in enumerate(self.zeros.zeros) if self.at_zeros.lo[k] >= level
        ]
        high += [] if near is None else [near]
        points = np.array(high).reshape(-1, 3).T
        return flood(self.land, start, level, low, points, limit)


def regions_of(energy: Energy, zeros: Zeros, box: Box, V: BoundedEnergy | None = None) -> Regions:
    """Return c* and the region of each minimum in a range.

    Args:
        energy: The energy.
        zeros: The rest states in the range, in the order of V.
        box: The range.
        V: Bounds on the energy; by default those of `energy`.
    """
    if not zeros.zeros:
        return NO_REGIONS
    land = Landscape(energy, zeros, box, Ranges.of(energy, V))
    certified = _certified(land)
    minima = [k for k, zero in enumerate(zeros.zeros) if is_minimum(zero)]
    # With springs, floods take too long.
    minima = [] if land.springs else minima
    found = [] if certified is None else [_region(land, k) for k in minima]
    return Regions(certified, tuple(one for one in found if one is not None))


def _certified(land: Landscape) -> Certified | None:
    lowest, *others = land.state_levels()
    levels = [*land.face_levels(), *others, *land.springs]
    if not levels:
        return None
    energy = min(one.value for one in levels)
    tie = TIE * max(abs(energy), abs(lowest.value))
    first = next(one for one in levels if one.value - energy <= tie)
    bound = min(land.cap, *(one.bound for one in levels))
    known = is_minimum(land.zeros.zeros[0]) and bound > -np.inf
    height = _height(land, 0, bound) if known else 0.0
    assert first.at is not None
    return Certified(
        energy,
        energy - lowest.value,
        height,
        bound if known else None,
        first.at,
        first.face,
        land.least is None or bool(land.least.closed.all()),
        0 if land.least is None else land.least.examined,
        first in land.springs,
    )


def _height(land: Landscape, state: int, bound: float) -> float:
    """Return a lower bound of how far an energy is above a rest state; 0 if below it."""
    return max(0.0, float(np.nextafter(bound - land.at_zeros.hi[state], -np.inf)))


def _region(land: Landscape, minimum: int) -> Region | None:
    """Return the region of a minimum, by the highest level at which a flood holds."""
    floor = float(land.at_zeros.hi[minimum])
    levels = [one for one in land.state_levels() if one.state != minimum] + land.face_levels()
    # Below all of them there is one component, and no flood is needed.
    base = min((*levels, _Level(land.cap, land.cap)), key=lambda one: one.bound)
    search = _Passes(land, minimum, base if base.bound > floor else None)
    search.run([one for one in levels if one is not base and land.is_pass(one)])
    best, flooded = search.best, search.flooded
    if best is None:
        return None
    bound = best.bound if flooded is None else flooded.level
    height = _height(land, minimum, bound)
    if not height > 0:
        return None
    value, examined = best.value - land.zeros.zeros[minimum].energy, search.examined
    return Region(minimum, value, height, bound, best.state, best.face, best.at, flooded, examined)


class _Passes:
    """The search for the pass of a minimum among some levels: each is above the one that holds."""

    def __init__(self, land: Landscape, minimum: int, base: _Level | None) -> None:
        self.land, self.minimum = land, minimum
        self.floor = float(land.at_zeros.hi[minimum])
        self.best, self.examined = base, 0
        self.flooded: Flooded | None = None
        self.start = land.zeros.zeros[minimum].enclosure

    def run(self, levels: list[_Level]) -> None:
        """Try levels, each at most once."""
        some = [one for one in levels if self.is_higher(one)]
        if self.land.cap < np.inf:
            some.append(_Level(self.land.cap, self.land.cap))
        some = sorted((one for one in some if self.is_higher(one)), key=lambda one: one.bound)
        begin, end = 0, len(some)
        while begin < end:
            middle = (begin + end) // 2
            if self.holds(some[middle]):
                begin = middle + 1
            else:
                end = middle
        if self.best is None and some:
            self.bisect(some[0].bound)

    def bisect(self, failed: float) -> None:
        """Try levels below all known passes: the component leaves by a part of a face."""
        known = self.floor
        for _ in range(BISECTIONS):
            middle = 0.5 * (known + failed)
            if self.holds(_Level(middle, middle)):
                assert self.best is not None
                if self.best.at is not None:
                    return
                known = middle
            else:
                failed = middle

    def is_higher(self, level: _Level) -> bool:
        """Return whether a level is worth a flood."""
        known = self.floor if self.best is None else self.best.bound
        gain = SMALLEST_GAIN * max(level.bound - self.floor, 0.0)
        return known + gain < level.bound <= self.land.cap

    def holds(self, level: _Level) -> bool:
        """Flood up to a level, or to the least energy on the parts of faces that this reaches."""
        land, k = self.land, self.minimum
        at = None if level.state is None else land.zeros.zeros[level.state]
        margins = RIDGE_MARGINS if at is not None and at.ridge else MARGINS
        for margin in (0.0,) if level.at is None else margins:
            height = level.bound - margin * (level.bound - self.floor)
            found = land.flood(k, height, level.at)
            self.examined += found.examined
            if found.holds:
                self.best, self.flooded = level, found
                return True
            if found.outcome is Outcome.LEAVES:
                lower = None if found.states else self.lower_on_faces(found)
                if lower is None or not lower.bound < level.bound:
                    return False
                return self.holds(lower)
        return False

    def lower_on_faces(self, found: Flooded) -> _Level | None:
        """Return the least level of the parts of faces that a flood reached, if it is a gain."""
        if not found.faces:
            return None
        parts = joined([boxes for _, _, boxes in found.faces], 3)
        for face in self.land.face_levels():
            x = face.at
            if x is not None and not self.is_higher(face) and parts.touch(Box(x, x)).any():
                return None
        over = self.land.V.values(parts)
        lowest = over.lo <= over.hi.min()
        least = least_values(self.land.V, parts[lowest])
        k = int(np.argmin(least.value))
        faces = [(axis, sign) for axis, sign, boxes in found.faces for _ in range(boxes.count)]
        face = faces[np.flatnonzero(lowest)[k]]
        level = _Level(float(least.bound.min()), float(least.value[k]), least.at[:, k], face=face)
        return level if self.is_higher(level) else None
