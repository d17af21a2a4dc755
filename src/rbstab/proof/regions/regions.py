"""c*, below which all motions approach the lowest rest state, and the region of each minimum.

c* is the least energy on the open faces of the range, at all other rest states, and in undecided
boxes: {V < c*} contains the lowest rest state alone. The region of any minimum is the component of
{V < level} about it, up to its pass, where it meets another rest state or an open face (`cells`).
The levels aimed at are the energies of the other rest states and the least ones of faces, or of
parts of faces by which a component leaves: one of these is the pass.

Hypotheses: `Zeros` has all rest states of the range but those in its undecided boxes, also those
that a stop holds; a motion does not reach the ends of closed axes (`Energy.closed`).
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.proof.boxes import Box, Boxes, joined
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.enclosures.levels import LOOSE, Ranges
from rbstab.proof.entries import NO_LENGTH, ProvedMinimum, ProvedRegion
from rbstab.proof.model import RANGE_END, Energy
from rbstab.proof.regions.cells import AT_ONCE, LIMIT, Cells, Pass
from rbstab.proof.regions.landscape import Face, Landscape, Level
from rbstab.proof.search import Zeros

TIE = 1e-10
"""Energies with a smaller relative difference count as equal; the first place is reported."""

MARGIN = 1e-6
"""How near the proved level is to a pass, relative to its height."""

RIDGE_MARGIN = 0.02
"""The same for a pass on a ridge, whose walls are thin: they take cells all along the ridge."""

REPEATED = 1e-9
"""Proved levels are lowered by so much, relatively, so that round-off is no reason to miss them."""

CHECKED = 1e-7
"""The certified level is lowered by so much, relative to its height above the lowest rest state. A
checker needs many boxes for a level that is almost attained, or cannot decide."""

NEAR = 0.05
"""rad: the component meets others at a pass if that is so near, and at its level."""

ENOUGH = 0.9
"""A pass is named if this share of its height is proved."""


@dataclass(frozen=True, eq=False)
class Regions:
    """The regions in a range; `certified` is None without a rest state, or if nothing bounds it."""

    certified: ProvedRegion | None
    minima: tuple[ProvedMinimum, ...]


NO_REGIONS = Regions(None, ())
"""Nothing is known."""


def regions_of(
    energy: Energy,
    zeros: Zeros,
    box: Box,
    V: BoundedEnergy | None = None,
    *,
    confining: bool = False,
) -> Regions:
    """Return c* and the region of each minimum in a range.

    Args:
        energy: The energy.
        zeros: The rest states in the range, in the order of V.
        box: The range.
        V: Bounds on the energy; by default those of `energy`.
        confining: Whether theorem 6 confines all rest states to the range.
    """
    if not zeros.zeros:
        return NO_REGIONS
    land = Landscape(energy, zeros, box, Ranges.of(energy, V), confining=confining)
    certified = _certified(land)
    # With springs, cells take too long.
    none = certified is None or land.springs
    return Regions(certified, () if none else tuple(_minima(land)))


def _certified(land: Landscape) -> ProvedRegion | None:
    lowest, *others = land.state_levels
    levels = [*land.lowest_face_levels, *others, *land.springs]
    if not levels:
        return None
    energy = min(candidate.value for candidate in levels)
    tie = TIE * max(abs(energy), abs(lowest.value))
    first = next(candidate for candidate in levels if candidate.value - energy <= tie)
    level = energy - lowest.value
    bound = _lowered(land, min(land.cap, *(candidate.bound for candidate in levels)))
    bounded = 0 in land.minima and bound > -np.inf
    return ProvedRegion(
        energy=energy,
        level=level,
        lower_bound=_height(land, 0, bound) if bounded else 0.0,
        attained_at=first.at,
        face=NO_LENGTH if first in land.springs else _name(land.box, first.face),
        proved=bounded and land.zeros.proved and energy - bound <= LOOSE * abs(level),
        energy_bound=bound if bounded else None,
    )


def _name(box: Box, face: Face | None) -> str | None:
    """Return the name of a face of a range, such as "θ2 = -π/2"; None of none."""
    if face is None:
        return None
    axis, sign = face
    end = box.hi[axis] if sign > 0 else -box.lo[axis]
    symbol = "π/2" if axis == PITCH else "π"
    size = symbol if end == RANGE_END[axis] else f"{end:.4g}"
    return f"θ{axis + 1} = {'-' if sign < 0 else ''}{size}"


def _height(land: Landscape, state: int, bound: float) -> float:
    """Return a lower bound of how far an energy is above a rest state; 0 if below it."""
    return max(0.0, float(np.nextafter(bound - land.at_zeros.hi[state], -np.inf)))


def _minima(land: Landscape) -> list[ProvedMinimum]:
    """Return the regions of minima."""
    ends = _ends(land)
    if 0 in land.minima:
        # Below these there is one component, that of the lowest state: no cells are needed.
        lowest = _lowest_end(land)
        ends[0] = max(lowest, ends.get(0, lowest), key=lambda level: level.bound)
    minima = []
    for k, end in sorted(ends.items()):
        height = _height(land, k, end.bound)
        if height > 0:
            entry = ProvedMinimum(
                rest_state=k + 1,
                level=end.value - land.zeros.zeros[k].energy,
                lower_bound=height,
                energy_bound=end.bound,
                pass_state=None if end.state is None else end.state + 1,
                pass_face=_name(land.box, end.face),
                pass_at=end.at,
            )
            minima.append(entry)
    return minima


def _lowest_end(land: Landscape) -> Level:
    """Return the least level at which the component of the lowest state may end."""
    levels = (*land.state_levels[1:], *land.lowest_face_levels, Level(land.cap, land.cap))
    least = min(levels, key=lambda level: level.bound)
    return replace(least, bound=_lowered(land, least.bound))


def _lowered(land: Landscape, bound: float) -> float:
    """Return a proved lower bound of an energy, lowered by its margin."""
    return bound - CHECKED * abs(bound - land.floor(0)) if math.isfinite(bound) else bound


def _is_end(land: Landscape, least: Level) -> bool:
    """Return whether the component of the lowest state ends at the least of all other levels."""
    # It does at a rest state that is no minimum, and on a face if V does not fall outwards there.
    if least.face is None or least.at is None:
        return land.is_pass(least)
    axis, sign = least.face
    slope = land.V.V.at(least.at[:, None])[1][axis, 0]
    return bool(sign * slope >= 0)


def _ends(land: Landscape) -> dict[int, Level]:
    """Return the passes of minima that cells prove: they are divided until all are known."""
    sought = [k for k in land.minima if land.floor(k) < land.cap]
    # The lowest is left out if its component is known to end at the least of all other levels.
    if 0 in sought and land.floor(0) < (least := _lowest_end(land)).bound and _is_end(land, least):
        sought.remove(0)
    searches = [_Search(land, k) for k in sought]
    if not searches:
        return {}
    cells = Cells.of(land)
    while True:
        for search in searches:
            search.reached = cells.flood(search.minimum, land.cap).end
        some = np.unique(np.concatenate([search.open_cells(cells) for search in searches]))
        if not len(some) or cells.count >= LIMIT:
            passes = {search.minimum: search.end(cells) for search in searches}
            return {k: end for k, end in passes.items() if end is not None}
        cells = cells.divided(some)


class _Search:
    """The search for the pass of one minimum."""

    def __init__(self, land: Landscape, minimum: int) -> None:
        self.land, self.minimum, self.floor = land, minimum, land.floor(minimum)
        levels = [
            level for level in land.state_levels[1:] if land.is_pass(level)
        ] + land.face_levels
        # The levels at which its component may end.
        self.levels = [level for level in levels if self.floor < level.bound < land.cap]
        if land.cap < np.inf:
            self.levels.append(Level(land.cap, land.cap))
        # The pass as it is proved so far; None if there is none below the cap.
        self.reached: Pass | None = None
        # The level, J, at which the component has left, as far as cells tell.
        self.top = np.inf

    @property
    def proved(self) -> float:
        """The proved level."""
        return self.land.cap if self.reached is None else self.reached.level

    def open_cells(self, cells: Cells) -> Array:
        """Return the cells that are to be divided for the next level; none at the end."""
        while not self._is_at_pass(cells) and (aim := self._aim()) is not None:
            open_, ends = cells.ways(self.minimum, aim)
            if not len(ends):
                return open_
            self.top = aim
            outlets = ends[cells.ends[ends] < aim]
            if len(outlets):
                lower = self._outlet(cells, outlets)
                if max(self.floor, self.proved) < lower.value < aim:
                    self.levels.append(lower)
        return np.zeros(0, dtype=int)

    def _is_at_pass(self, cells: Cells) -> bool:
        """Return whether the component meets others at a known pass, near its level."""
        if self.reached is None:
            return True
        place = cells.place(self.reached.edge)
        return any(
            abs(self.proved - level.value) <= self._margin(level) and level.distance(place) <= NEAR
            for level in self.levels
        )

    def _aim(self) -> float | None:
        """Return the level that is tried next: just below the next pass, if one is known."""
        for level in sorted(self.levels, key=lambda level: level.bound):
            margin = self._margin(level)
            aim = level.bound - 0.9 * margin
            # The margin of a very shallow region may be lost in round-off.
            if level.bound <= self.top and aim < self.top and self.proved < level.bound - margin:
                return aim
        low = max(self.proved, self.floor)
        if self.top == np.inf or self.top - low <= MARGIN * (self.top - self.floor):
            return None
        middle = 0.5 * (low + self.top)
        return middle if low < middle < self.top else None

    def _margin(self, level: Level) -> float:
        if level.at is None:
            return 0.0
        share = RIDGE_MARGIN if self.land.is_ridge(level) else MARGIN
        return share * (level.bound - self.floor)

    def _outlet(self, cells: Cells, some: Array) -> Level:
        """Return a level near the least one on the parts of open faces of some cells."""
        some = some[np.argsort(cells.ends[some], kind="stable")][:AT_ONCE]
        rows = self.land.faces(cells.boxes[some])
        parts = joined([part.boxes for part in rows], 3)
        _, _, near = self.land.V.over(parts)
        near = np.clip(near, parts.lo, parts.hi)
        value = self.land.V.values(Boxes(near, near)).hi
        k = int(np.argmin(value))
        faces = [part.face for part in rows for _ in part.places]
        return Level(float(value[k]), float(value[k]), near[:, k], face=faces[k])

    def end(self, cells: Cells) -> Level | None:
        """Return the pass as it is proved, and where it is; None if nothing is proved."""
        if not self.floor < self.proved < np.inf:
            return None
        if self.reached is None:
            return Level(self.land.cap, self.land.cap)
        bound = self.proved - REPEATED * (self.proved - self.floor)
        place = cells.place(self.reached.edge)
        level = self._named(place)
        if level is None and cells.border in self.reached.edge:
            level = self._outlet(cells, np.array([min(self.reached.edge)]))
        if level is None:
            level = Level(bound, bound, 0.5 * place.lo + 0.5 * place.hi)
        return replace(level, bound=bound)

    def _named(self, place: Box) -> Level | None:
        """Return the known level that is the pass at a place, if its height is proved, about."""
        slack = 2 * MARGIN * (self.proved - self.floor)
        left = [level for level in self.levels if level.bound >= self.proved - slack]
        least = min((level.bound for level in left), default=np.inf)
        if least > self.top or self.proved - self.floor < ENOUGH * (least - self.floor):
            return None
        return min(
            (level for level in left if level.bound <= least + 2 * slack),
            key=lambda level: level.distance(place),
        )
