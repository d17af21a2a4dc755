"""Check the regions in which every motion converges to one rest state: theorems 3 and 5."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import arb

from rbstab.analysis.proof_check.boxes import Box, flat, gap, touches, width
from rbstab.analysis.proof_check.claims import RestState
from rbstab.analysis.proof_check.cover import Cover, cover
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.findings import Face, Finding, Range
from rbstab.analysis.proof_check.flood import WALL, WET, Sides, Terrain, flood, meet, name_of_sides
from rbstab.analysis.proof_check.formulas.kinks import Kink, signs_over
from rbstab.analysis.proof_check.taylor import Taylor, centre_and_step
from rbstab.analysis.proof_check.trigonometric import Ball

SHARES = (1 / 2, 1 / 4, 1 / 8, 1 / 16)
"""The widths of wet boxes that are tried, as shares of the distance to a high place."""

ABOVE = "b"
"""The reason of a box in which U is at least the bound."""

OTHER_SIDE = "o"
"""The reason of a box of the border that has no point on the sides of its cell."""

WALL_WIDTH = 0.01
"""rad: walls are looked for in all boxes narrower than a share of this. Near a pass on a ridge no
box is dry, so without this limit boxes would be halved too often there."""

FAR = 2.0
"""rad: a larger distance counts as this one."""


@dataclass(frozen=True)
class Region:
    """The claim that motions with an energy below a bound converge to one rest state.

    Attributes:
        U: The energy.
        claim: `energy_bound` and `lower_bound`, J.
        state: The rest state.
        places: Boxes with all other rest states, by name: enclosures and undecided boxes.
        range_: The range.
    """

    U: Energy
    claim: Mapping[str, Any]
    state: RestState
    places: Mapping[str, Box]
    range_: Range

    def check_everywhere(self) -> Finding:
        """Check theorem 3: the border and all other rest states are not below the bound."""
        covers = {name: self._cover(box) for name, box in self.places.items()}
        for face in self.range_.faces:
            covers[face.name] = self._cover(flat(self.range_.box, face.axis), face)
        wrong = [
            f"The energy at {place} is not shown to be at least {self._bound}."
            for place, found in covers.items()
            if found.open is not None
        ]
        return self._finding("certified region", f" converges to {self.state.name}", wrong, covers)

    def check_component(self) -> Finding:
        """Check theorem 5: flood all boxes that motions near the rest state may reach.

        The flood may reach neither another rest state nor a point of the border below the bound.
        """
        high = [box for box in self.places.values() if self._cover(box).open is None]
        low = {name: box for name, box in self.places.items() if box not in high}
        known, border = dict[Box, str | None](), dict[str, Cover]()

        def obstacle(box: Box, sides: Sides) -> str | None:
            """Return what may be reached in a box that is flooded, on some sides of its ridges.

            Adds the covers of its part of the border.
            """
            for name, place in low.items():
                if touches(box, place):
                    return name
            for face in self.range_.faces:
                if box[face.axis][face.end] == self.range_.box[face.axis][face.end]:
                    name = f"{face.name}, part {len(border) + 1}{name_of_sides(sides)}"
                    border[name] = self._cover(flat(box, face.axis), face, sides)
                    if border[name].open is not None:
                        return face.name
            return None

        for share in SHARES:
            border.clear()
            reason = self._reason_of(share, high, known)
            terrain = Terrain(reason, obstacle, self._sides)
            found = flood(self.range_.box, self.state.enclosure, terrain, self.U.stretch)
            if found.obstacle is None:
                break
        wrong = [f"Motions below {self._bound} are not shown to stay away from {found.obstacle}."]
        component = f"the component of {{U < {self._bound}}} about {self.state.name}"
        covers = {"range": found.cover, **border}
        name = f"region of {self.state.name}"
        text = f" and Θ in {component} converges to it"
        return self._finding(name, text, wrong if found.obstacle else [], covers)

    def _reason_of(
        self, share: float, high: Iterable[Box], known: dict[Box, str | None]
    ) -> Callable[[Box], str | None]:
        """Return a function that tells of a box whether it is dry, is wet, or has a wall.

        It is dry if U is at least the bound in all of it, and wet if U is below the bound in all of
        it. Another box is halved until it is small beside the way to the next high place and
        through it, as most passes are high places, or smaller than a share of `WALL_WIDTH`. Then it
        has a wall if U is at least the bound on a ridge in it. Else it is wet once it is small
        beside that way.
        """
        bound = arb(self.claim["energy_bound"])

        def reason(box: Box) -> str | None:
            taylor = None if box in known else Taylor(self.U, box)
            if taylor is not None:
                below = WET if taylor.values < bound else None
                known[box] = ABOVE if taylor.stays_above(bound) else below
            if known[box] is not None:
                return known[box]
            distance = min((gap(box, place) + width(place) for place in high), default=FAR)
            wet = WET if width(box) <= share * min(distance, FAR) else None
            if width(box) > share * max(min(distance, FAR), WALL_WIDTH) or not self._ridges:
                return wet
            wall = (taylor or Taylor(self.U, box)).wall(bound)
            return wet if wall is None else f"{WALL}{wall + 1}"

        return reason

    @cached_property
    def _ridges(self) -> list[Kink]:
        return [one for one in self.U.kinks if one.ridge]

    def _sides(self, box: Box, face: tuple[int, Ball] | None = None) -> Sides:
        """Return on which sides of each ridge a box is."""
        return tuple(signs_over(one, *centre_and_step(box, face)) for one in self._ridges)

    def _cover(self, box: Box, face: Face | None = None, sides: Sides | None = None) -> Cover:
        """Cover a box by boxes in which U is at least the bound.

        With sides, only points on these sides of the ridges matter.
        """
        bound = arb(self.claim["energy_bound"])
        place = None if face is None else (face.axis, face.place)
        shares = self._shares(sides) if sides else None

        def reason(b: Box) -> str | None:
            if sides and not meet(self._sides(b, place), sides):
                return OTHER_SIDE
            return ABOVE if Taylor(self.U, b, place, None, shares).stays_above(bound) else None

        return cover(box, reason, stretch=self.U.stretch)

    def _shares(self, sides: Sides) -> list[float | None]:
        """Return λ of each kink: 1 or 0 of a ridge whose one side is known, where it is λh."""
        of_ridges = iter(sides)
        signs = [next(of_ridges) if one.ridge else frozenset({-1, 1}) for one in self.U.kinks]
        return [None if len(one) > 1 else float(-1 in one) for one in signs]

    @property
    def _bound(self) -> str:
        return f"{self.claim['energy_bound']:.10g} J"

    def _finding(
        self, name: str, converges: str, wrong: list[str], covers: Mapping[str, Cover]
    ) -> Finding:
        """Return what was found. `lower_bound` is checked for both theorems: v and E differ by U.

        Args:
            name: The claim.
            converges: Which motions converge, as the end of a sentence.
            wrong: Sentences on what is wrong.
            covers: The covers.
        """
        # v counts from the rest state.
        height = arb(self.claim["energy_bound"]) - Taylor(self.U, self.state.enclosure).values
        lower = self.claim["lower_bound"]
        if not (lower == 0 or arb(lower) <= height):
            wrong.append(f"v < {lower:.10g} J is more than an energy below {self._bound}.")
        text = f"Every motion with an energy below {self._bound}{converges}."
        if height <= 0:
            text = f"It is empty: the energy of {self.state.name} is at least {self._bound}."
        return Finding(self.range_.name, name, not wrong, " ".join(wrong) or text, covers)
