"""The regions in which every motion converges to one rest state: theorems 3 and 5."""

from collections.abc import Iterator
from functools import partial
from typing import Any

from flint import arb

from rbstab.proof.check.bounds import Bounds
from rbstab.proof.check.convex import parts_of, without_length
from rbstab.proof.check.cover import TOO_MANY, WET, cover, flattened, flood, gap, touches, width
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import EVERYWHERE, Box, Cover, Finding
from rbstab.proof.check.listed import Listed
from rbstab.proof.check.ranges import Face
from rbstab.proof.check.states import State

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
        self.state, self.U, self.range = state, listed.U, listed.range
        self.bound, self.shown = arb(level), f"{level:.10g} J"
        self.places = listed.places_but(state)

    def everywhere(self) -> Finding:
        """Check theorem 3: the border and all other rest states are not below the level."""
        lengths = self._lengths()
        covers = {name: self._cover(box) for name, box in self.places.items()} | lengths
        # Where none is beyond the ends of θ1 and θ3 (theorem 6), U rises without end there.
        confining = self.range.name == EVERYWHERE and not lengths
        for face in self.range.border:
            if face.axis == 1 or not confining:
                covers[face.name] = self._cover(self.range.box, face)
        wrong = [
            f"The energy at {place} is not shown to be at least {self.shown}."
            for place, found in covers.items()
            if found.open is not None
        ]
        text = f"Every motion with an energy below {self.shown} converges to {self.state.name}."
        return self._finding("certified region", text, " ".join(wrong), covers)

    def component(self) -> Finding:
        """Check theorem 5: flood all boxes that motions near the rest state may reach.

        The flood may reach neither another rest state nor a point of the border below the level.
        """
        low = {k: box for k, box in self.places.items() if self._cover(box).open is not None}
        high = [box for name, box in self.places.items() if name not in low]
        known, border = dict[Box, str | None](), dict[str, Cover]()

        def reason_for(share: float, box: Box) -> str | None:
            if box not in known:
                over = Bounds(self.U, box)
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
                    found = self._cover(box, face)
                    border[f"{face.name}, part {len(border) + 1}"] = found
                    if found.open is not None:
                        return face.name
            return None

        for share in SHARES:
            border.clear()
            reason = partial(reason_for, share)
            found, stopped = flood(self.range.box, self.state.enclosure, reason, obstacle)
            if stopped in (None, TOO_MANY):  # smaller boxes would be more
                break
        lengths = self._lengths()
        stopped = stopped or next((k for k, c in lengths.items() if c.open is not None), None)
        wrong = f"Motions below {self.shown} are not shown to stay away from {stopped}."
        text = (
            f"Every motion with an energy below {self.shown} and Θ in the component of "
            f"{{U < {self.shown}}} about {self.state.name} converges to it."
        )
        covers = {"range": found, **border, **lengths}
        return self._finding(f"region of {self.state.name}", text, wrong if stopped else "", covers)

    def _lengths(self) -> dict[str, Cover]:
        """Cover the range, for each spring, by boxes in which it has a length below the level."""
        lines = parts_of(self.U).lines if self.U.free else ()
        energies = {k: without_length(self.U, line) for k, line in enumerate(lines, start=1)}
        return {
            f"no length of spring {k}": self._cover(self.range.box, of=U)
            for k, U in energies.items()
        }

    def _cover(self, box: Box, face: Face | None = None, of: Energy | None = None) -> Cover:
        """Cover a box, or a part of a face, by boxes in which U is at least the level."""
        U, flat = of or self.U, None
        if face is not None:
            box, flat = flattened(box, face.axis), (face.axis, face.place)
        return cover(box, lambda b: ABOVE if Bounds(U, b, flat).at_least(self.bound) else None)

    def _finding(self, name: str, text: str, wrong: str, covers: dict[str, Cover]) -> Finding:
        if self.bound <= Bounds(self.U, self.state.enclosure).values:
            text = f"It is empty: the energy of {self.state.name} is at least {self.shown}."
        return Finding(self.range.name, name, not wrong, wrong or text, covers)


def region_findings(listed: Listed, claims: Any) -> Iterator[Finding]:
    """Check the regions that are claimed.

    Raises:
        IndexError: One is of no rest state.
    """
    regions = [(0, claims.get("level"), True)] + [
        (*one, False) for one in claims.get("regions", [])
    ]
    for place, level, everywhere in regions:
        if level is None and everywhere:
            continue
        if type(place) is not int or place < 0:
            raise IndexError("a region of no rest state")
        state = listed.states[place]
        if state.index == 0:
            region = Region(listed, state, float(level))
            yield region.everywhere() if everywhere else region.component()
            continue
        name = "certified region" if everywhere else f"region of {state.name}"
        text = f"R{state.name[1:]} is not proved to be a minimum."
        yield Finding(listed.range.name, name, False, text)
