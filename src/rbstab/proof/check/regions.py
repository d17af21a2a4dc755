"""The regions in which every motion converges to one rest state: theorems 3, 5 and 11."""

from collections.abc import Iterator
from functools import cache, partial
from itertools import product
from typing import Any

from flint import arb

from rbstab.proof.check.bounds import Bounds, Face
from rbstab.proof.check.convex import Line, WithoutLength, parts_of
from rbstab.proof.check.cover import TOO_MANY, WET, cover, flattened, flood, gap, touches, width
from rbstab.proof.check.energy import Energy, share_of
from rbstab.proof.check.findings import EVERYWHERE, Box, Cover, Finding, confirmed
from rbstab.proof.check.ranges import Range
from rbstab.proof.check.states import Listed, State

SHARES = (1 / 2, 1 / 4, 1 / 8, 1 / 16)
"""The widths of wet boxes that are tried, as shares of the distance to a high place."""

ABOVE = "b"
"""The reason of a box in which U is at least the bound."""

BEYOND = "o"
"""The reason of a box beyond a ridge."""

WALL = "the other side of a ridge"

LIMIT = 1000
"""Boxes of a part of a ridge."""

FAR = 2.0
"""rad: a larger distance counts as this one."""


class Level:
    """An energy, and covers by boxes in which U is at least as large.

    Args:
        U: The energy U.
        range_: The range.
        level: The level, J.
    """

    def __init__(self, U: Energy, range_: Range, level: float) -> None:
        self.U, self.range = U, range_
        self.bound, self.shown = arb(level), f"{level:.10g} J"

    def cover(self, box: Box, face: Face | None = None, of: Energy | None = None) -> Cover:
        """Cover a box, or a part of a face.

        Args:
            box: The box.
            face: If it is given, the part of this face in the box is covered.
            of: The energy that is at least the level there; U if it is not given.
        """
        U, box = of or self.U, box if face is None else flattened(box, face.axis)
        return cover(box, lambda b: ABOVE if Bounds(U, b, face).at_least(self.bound) else None)

    @property
    def lines(self) -> tuple[Line, ...]:
        """The springs of a body that is not held."""
        return parts_of(self.U).lines if self.U.free else ()

    def border(self) -> dict[str, Cover]:
        """Cover all faces through which a motion may leave the range, by their names."""
        # Where none is beyond the ends of θ1 and θ3 (theorem 6), U rises without end there.
        confining = self.range.name == EVERYWHERE and not self.lines
        faces = [face for face in self.range.border if face.axis == 1 or not confining]
        return {face.name: self.cover(self.range.box, face) for face in faces}

    def lengths(self) -> dict[str, Cover]:
        """Cover the range, for each spring, by boxes where U is so large if it has no length."""
        return {
            f"no length of spring {k}": self.cover(self.range.box, of=WithoutLength(self.U, line))
            for k, line in enumerate(self.lines, start=1)
        }


class Region(Level):
    """The claim that motions with an energy below a level converge to one rest state.

    Args:
        listed: All rest states.
        state: The rest state.
        level: The energy, J.
    """

    def __init__(self, listed: Listed, state: State, level: float) -> None:
        super().__init__(listed.U, listed.range, level)
        self.state, self.places = state, listed.places_but(state)

    def everywhere(self) -> Finding:
        """Check theorem 3: the border and all other rest states are not below the level."""
        places = {name: self.cover(box) for name, box in self.places.items()}
        covers = places | self.lengths() | self.border()
        wrong = [
            f"The energy at {place} is not shown to be at least {self.shown}."
            for place, c in covers.items()
            if c.open is not None
        ]
        text = f"Every motion with an energy below {self.shown} converges to {self.state.name}."
        return self._finding("certified region", text, " ".join(wrong), covers)

    def component(self) -> Finding:
        """Check theorem 5: flood all boxes that motions near the rest state may reach.

        The flood may reach neither another rest state nor a point of the border below the level.
        """
        low = {k: box for k, box in self.places.items() if self.cover(box).open is not None}
        high = [box for name, box in self.places.items() if name not in low]
        border = dict[str, Cover]()
        at_rest = Bounds(self.U, self.state.enclosure)
        ridges = {k: at_rest.side(k) for k in map(share_of, self.U.jumps) if at_rest.side(k)}
        walls_of = {True: ridges, False: dict[int, int]()}

        @cache
        def reason_by_bounds(walled: bool, box: Box) -> str | None:
            over = self._on_this_side(walls_of[walled], box)
            if over is None:
                return BEYOND
            if over.at_least(self.bound):
                return ABOVE
            return WET if over.below(self.bound) else None

        def reason_for(share: float, walled: bool, box: Box) -> str | None:
            distance = min((gap(box, place) + width(place) for place in high), default=FAR)
            small = width(box) <= share * min(distance, FAR)
            return reason_by_bounds(walled, box) or (WET if small else None)

        def obstacle_of(walled: bool, box: Box) -> str | None:
            for name, place in low.items():
                if touches(box, place):
                    return name
            for face in self.range.border:
                if self.range.reaches(face, box):
                    face_cover = self.cover(box, face)
                    border[f"{face.name}, part {len(border) + 1}"] = face_cover
                    if face_cover.open is not None:
                        return face.name
            return None if self._closed_by(walls_of[walled], box) else WALL

        for walled, share in product([True, False] if ridges else [False], SHARES):
            border.clear()
            reason, obstacle = partial(reason_for, share, walled), partial(obstacle_of, walled)
            flooded, stopped = flood(self.range.box, self.state.enclosure, reason, obstacle)
            if stopped in (None, TOO_MANY):  # smaller boxes would be more
                break
        lengths = self.lengths()
        stopped = stopped or next((k for k, c in lengths.items() if c.open is not None), None)
        wrong = f"Motions below {self.shown} are not shown to stay away from {stopped}."
        text = (
            f"Every motion with an energy below {self.shown} and Θ in the component of "
            f"{{U < {self.shown}}} about {self.state.name} converges to it."
        )
        flooded = flooded._replace(places={"start": self.state.enclosure})
        covers = {"range": flooded, **border, **lengths}
        return self._finding(f"region of {self.state.name}", text, wrong if stopped else "", covers)

    def _on_this_side(self, walls: dict[int, int], box: Box) -> Bounds | None:
        """Return bounds over the part of a box on the side of the rest state; None without one."""
        over = Bounds(self.U, box)
        # `walls` has the signs of the arguments of steps at the rest state, by their variables.
        if any(over.side(k) == -side for k, side in walls.items()):
            return None
        if len(over.jumps) == 1 and over.jumps[0] in walls:
            step = float(walls[over.jumps[0]] > 0)
            return Bounds(self.U, box, share=(step, step))
        return over

    def _closed_by(self, walls: dict[int, int], box: Box) -> bool:
        """Return whether U is at least the level where a box meets a wall."""

        def reason(part: Box) -> str | None:
            over = Bounds(self.U, part)
            if walls.keys().isdisjoint(over.jumps):
                return BEYOND
            if len(over.jumps) > 1:
                return None
            # Where a force jumps, U is L(Θ, λ) for λ = 0, or for any λ if L is linear in it.
            low, high = over.share_at_rest(ridge=True) or (0.0, 0.0)
            step = (low + high) / 2
            bounds = Bounds(self.U, part, share=(step, step))
            return ABOVE if bounds.at_least(self.bound) else None

        return not walls or cover(box, reason, LIMIT).open is None

    def _finding(self, name: str, text: str, wrong: str, covers: dict[str, Cover]) -> Finding:
        if Bounds(self.U, self.state.enclosure).at_least(self.bound):
            text = f"It is empty: the energy of {self.state.name} is at least {self.shown}."
        return Finding(self.range.name, name, not wrong, wrong or text, covers)


def kept(U: Energy, range_: Range, level: float) -> Finding:
    """Check theorem 11: motions below a level do not reach the ends of the range.

    Args:
        U: The energy.
        range_: The range.
        level: The level, J.
    """
    energy_level = Level(U, range_, level)
    text = f"Every motion with an energy below {energy_level.shown} keeps the range"
    return confirmed(range_.name, "range", text, energy_level.border())


def region_findings(listed: Listed, claims: Any) -> Iterator[Finding]:
    """Check the regions that are claimed.

    Raises:
        IndexError: One is of no rest state.
    """
    regions = [(*region, Region.component) for region in claims.get("regions", [])]
    if claims.get("level") is not None:
        regions.insert(0, (0, claims["level"], Region.everywhere))
    for place, level, check in regions:
        if type(place) is not int or place < 0:
            raise IndexError("a region of no rest state")
        state = listed.states[place]
        if state.index == 0:
            yield check(Region(listed, state, float(level)))
            continue
        name = "certified region" if check is Region.everywhere else f"region of {state.name}"
        text = f"R{state.name[1:]} is not proved to be a minimum."
        yield Finding(listed.range.name, name, False, text)
