"""The rest states of a range: each is isolated, and there are no others."""

from collections.abc import Iterator
from functools import cached_property
from typing import Any

from flint import arb

from rbstab.proof.check.cover import cover, disjoint, flattened, wider, within
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import Box, Cover, Finding, RefusedError
from rbstab.proof.check.least import bounds
from rbstab.proof.check.ranges import Face, Range, box_of
from rbstab.proof.check.states import AtJump, AtStop, Isolated, State, no_rest_along_a_jump

AROUND_UNDECIDED = 1e-6
"""rad: the cover leaves out so much about undecided boxes, so that it ends."""

MOST_PLACES = 1000
"""The most rest states and undecided boxes of a range."""


def states_of(claims: Any) -> list[State]:
    """Return the rest states that are claimed.

    Raises:
        RefusedError: They cannot be read.
    """
    listed = claims["states"]
    if len(listed) + len(claims.get("undecided", [])) > MOST_PLACES:
        raise RefusedError(f"there are more than {MOST_PLACES} rest states and undecided boxes")
    found = list[State]()
    for number, one in enumerate(listed, start=1):
        box, index = box_of(one["enclosure"]), one["index"]
        if not (index is None or (type(index) is int and 0 <= index <= 3)):
            raise RefusedError("an index is no number from 0 to 3")
        found.append(State(number, box, index, bool(one.get("held")), bool(one.get("ridge"))))
    return found


def isolated(U: Energy, state: State, range_: Range) -> Isolated:
    """Return the check of a rest state, by what holds the body there."""
    if not state.held:
        return Isolated(U, state, range_)
    low, high = state.enclosure[1]
    at_stop = range_.stop is not None and any(
        arb(low) <= face.place <= arb(high) or face.place.overlaps(arb(low))
        for face in range_.faces(1)
    )
    if at_stop:
        return AtStop(U, state, range_)
    return Isolated(U, state, range_) if U.free else AtJump(U, state, range_)


class Listed:
    """The rest states of a range that a proof claims, and boxes that it leaves undecided.

    Args:
        U: The energy.
        claims: The claims.
        range_: The range.
    """

    def __init__(self, U: Energy, claims: Any, range_: Range) -> None:
        self.U, self.range = U, range_
        self.states = states_of(claims)
        self.undecided = [box_of(one) for one in claims.get("undecided", [])]
        self.complete = claims["complete"] is True
        self.checks = [isolated(U, one, range_) for one in self.states]

    def findings(self) -> Iterator[Finding]:
        """Check that each is isolated, and that there is no other."""
        wrong = [fault for one in self.checks if (fault := one.fault) is not None]
        if not disjoint(one.enclosure for one in self.states):
            wrong.append("Two enclosures have a point in common.")
        if self.complete and self.undecided:
            wrong.append("The rest states are said to be all, but some boxes are undecided.")
        text = f"{len(self.states)} are isolated, each in its enclosure."
        yield Finding(self.range.name, "rest states", not wrong, " ".join(wrong) or text)
        if wrong:
            return
        covers = {"range": self._cover_of_range()}
        if self.range.stop is not None:
            for face in self.range.faces(1):
                covers[face.name] = self._cover_of_stop(face)
        opened = next((one.open for one in covers.values() if one.open is not None), None)
        outside = f" outside of {len(self.undecided)} undecided boxes" if self.undecided else ""
        text = f"There is no other{outside}."
        if opened is not None:
            shown = ", ".join(f"[{a:.6g}, {b:.6g}]" for a, b in opened)
            text = f"The box {shown} may contain one that is not listed."
        yield Finding(self.range.name, "no other rest state", opened is None, text, covers)

    @cached_property
    def _undecided_places(self) -> dict[str, Box]:
        return {f"u{k}": wider(b, AROUND_UNDECIDED) for k, b in enumerate(self.undecided, start=1)}

    def _cover_of_range(self) -> Cover:
        inner = [one for one in self.checks if not isinstance(one, AtStop)]
        places = {f"s{one.state.number}": one.domain for one in inner} | self._undecided_places

        def reason(box: Box) -> str | None:
            for name, place in places.items():
                if within(box, place):
                    return name
            found = bounds(self.U, box).excludes_zero()
            jumps = found is None and bool(self.U.steps) and not self.U.free
            return no_rest_along_a_jump(self.U, box) if jumps else found

        return cover(self.range.box, reason)._replace(places=places)

    def _cover_of_stop(self, face: Face) -> Cover:
        """Cover a stop by boxes on which U rises outwards, or no other state is."""
        on_it = [
            one for one in self.checks if isinstance(one, AtStop) and one.face.side == face.side
        ]
        places = {f"s{one.state.number}": flattened(one.domain, 1) for one in on_it}
        places |= {
            name: flattened(box, 1)
            for name, box in self._undecided_places.items()
            if arb(box[1][0]) <= face.place <= arb(box[1][1])
        }

        def reason(box: Box) -> str | None:
            for name, place in places.items():
                if within(box, place):
                    return name
            over = bounds(self.U, box, (face.axis, face.place))
            return "f" if over.normal * face.side > 0 else over.excludes_zero()

        return cover(flattened(self.range.box, 1), reason)._replace(places=places)

    def places_but(self, state: State) -> dict[str, Box]:
        """Return boxes with all rest states but one, by name."""
        others = {one.name: one.enclosure for one in self.states if one is not state}
        return others | {
            f"undecided box {name[1:]}": b for name, b in self._undecided_places.items()
        }
