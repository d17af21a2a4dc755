"""The regions in which every motion converges to one rest state: theorems 3 and 5."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from flint import arb

from rbstab.proof.check.bounds import Bounds
from rbstab.proof.check.cover import TOO_MANY, WET, cover, flattened, flood, gap, touches, width
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import EVERYWHERE, Box, Cover, Finding
from rbstab.proof.check.least import bounds
from rbstab.proof.check.listed import Listed
from rbstab.proof.check.ranges import Face
from rbstab.proof.check.springs import Collapsed
from rbstab.proof.check.states import State
from rbstab.proof.check.taylor import Ball

SHARES = (1 / 2, 1 / 4, 1 / 8, 1 / 16)
"""The widths of wet boxes that are tried, as shares of the distance to a high place."""

ABOVE = "b"
"""The reason of a box in which U is at least the bound."""

FAR = 2.0
"""rad: a larger distance counts as this one."""


class Region:
    """The claim that motions with an energy below a level converge to one rest state.

    Args:
        listed: All rest states.
        state: The rest state.
        level: The energy, J.
    """

    def __init__(self, listed: Listed, state: State, level: float) -> None:
        self.listed, self.state, self.level = listed, state, level
        self.U, self.range, self.bound = listed.U, listed.range, arb(level)
        self.places = listed.places_but(state)

    def everywhere(self) -> Finding:
        """Check theorem 3: the border and all other rest states are not below the level."""
        lengths = self._lengths()
        covers = {name: self._cover(box) for name, box in self.places.items()} | lengths
        # Where none is beyond the ends of θ1 and θ3 (theorem 6), U rises without end there.
        confining = self.range.name == EVERYWHERE and not lengths
        for face in self.range.border:
            if face.axis == 1 or not confining:
                covers[face.name] = self._cover(flattened(self.range.box, face.axis), face)
        wrong = [
            f"The energy at {place} is not shown to be at least {self._shown}."
            for place, found in covers.items()
            if found.open is not None
        ]
        text = f"Every motion with an energy below {self._shown} converges to {self.state.name}."
        return self._finding("certified region", text, wrong, covers)

    def component(self) -> Finding:
        """Check theorem 5: flood all boxes that motions near the rest state may reach.

        The flood may reach neither another rest state nor a point of the border below the level.
        """
        high = [box for box in self.places.values() if self._cover(box).open is None]
        low = {name: box for name, box in self.places.items() if box not in high}
        known, border = dict[Box, str | None](), dict[str, Cover]()

        def reason_for(share: float, box: Box) -> str | None:
            if box not in known:
                over = bounds(self.U, box)
                below = WET if over.values < self.bound else None
                known[box] = ABOVE if over.at_least(self.bound) else below
            if known[box] is not None:
                return known[box]
            distance = min((gap(box, place) + width(place) for place in high), default=FAR)
            return WET if width(box) <= share * min(distance, FAR) else None

        def obstacle(box: Box) -> str | None:
            for name, place in low.items():
                if touches(box, place):
                    return name
            for face in self.range.border:
                if self.range.reaches(face, box):
                    found = self._cover(flattened(box, face.axis), face)
                    border[f"{face.name}, part {len(border) + 1}"] = found
                    if found.open is not None:
                        return face.name
            return None

        for share in SHARES:
            border.clear()
            found, stopped = flood(
                self.range.box,
                self.state.enclosure,
                partial(reason_for, share),
                obstacle,
            )
            if stopped in (None, TOO_MANY):  # smaller boxes would be more
                break
        lengths = self._lengths()
        stopped = stopped or next((k for k, c in lengths.items() if c.open is not None), None)
        wrong = (
            []
            if stopped is None
            else [f"Motions below {self._shown} are not shown to stay away from {stopped}."]
        )
        text = (
            f"Every motion with an energy below {self._shown} and Θ in the component of "
            f"{{U < {self._shown}}} about {self.state.name} converges to it."
        )
        return self._finding(
            f"region of {self.state.name}", text, wrong, {"range": found, **border, **lengths}
        )

    @property
    def _shown(self) -> str:
        return f"{self.level:.10g} J"

    def _lengths(self) -> dict[str, Cover]:
        """Cover the range, for each spring, by boxes in which it has a length below the level."""
        found, U = dict[str, Cover](), self.U
        for k, line in enumerate(U.springs.lines if U.free else (), start=1):
            found[f"no length of spring {k}"] = cover(
                self.range.box, partial(self._is_above, Collapsed(U, line))
            )
        return found

    def _is_above(self, U: Energy, box: Box) -> str | None:
        return ABOVE if Bounds(U, box).at_least(self.bound) else None

    def _cover(self, box: Box, face: Face | None = None) -> Cover:
        """Cover a box by boxes in which U is at least the level."""
        place: tuple[int, Ball] | None = None if face is None else (face.axis, face.place)
        return cover(
            box, lambda b: ABOVE if bounds(self.U, b, place).at_least(self.bound) else None
        )

    def _finding(
        self, name: str, text: str, wrong: list[str], covers: Mapping[str, Cover]
    ) -> Finding:
        if self.bound <= bounds(self.U, self.state.enclosure).values:
            text = f"It is empty: the energy of {self.state.name} is at least {self._shown}."
        return Finding(self.range.name, name, not wrong, " ".join(wrong) or text, covers)


def regions(listed: Listed, claims: Any) -> list[tuple[bool, State, float]]:
    """Return the regions that are claimed: whether of all the range, the rest state, the level."""
    found = list[tuple[bool, State, float]]()
    if claims.get("level") is not None:
        found.append((True, listed.states[0], float(claims["level"])))
    for place, level in claims.get("regions", []):
        if type(place) is not int or place < 0:
            raise IndexError("a region of no rest state")
        found.append((False, listed.states[place], float(level)))
    return found
