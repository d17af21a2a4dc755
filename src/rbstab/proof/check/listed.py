"""The rest states of a range: each is isolated, and there are no others."""

from collections.abc import Iterator
from typing import Any

from flint import arb

from rbstab.proof.check.bounds import Bounds
from rbstab.proof.check.cover import cover, disjoint, flattened, wider, within
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import Box, Cover, Finding, RefusedError, shown
from rbstab.proof.check.ranges import Face, Range, box_of
from rbstab.proof.check.states import State, isolated, no_rest_along_a_jump

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
        undecided = [box_of(one) for one in claims.get("undecided", [])]
        self.undecided = {
            f"u{k}": wider(box, AROUND_UNDECIDED) for k, box in enumerate(undecided, start=1)
        }
        self.complete = claims["complete"] is True
        self.checks = [isolated(U, one, range_) for one in self.states]

    def findings(self) -> Iterator[Finding]:
        """Check that each is isolated, and that there is no other."""
        name, left = self.range.name, len(self.undecided)
        wrong = [fault for one in self.checks if (fault := one.fault) is not None]
        if not disjoint(one.enclosure for one in self.states):
            wrong.append("Two enclosures have a point in common.")
        if self.complete and left:
            wrong.append("The rest states are said to be all, but some boxes are undecided.")
        text = f"{len(self.states)} are isolated, each in its enclosure."
        yield Finding(name, "rest states", not wrong, " ".join(wrong) or text)
        faces = self.range.faces(1) if self.range.stop is not None else ()
        covers = {"range": self._cover()} | {face.name: self._cover(face) for face in faces}
        opened = next((one.open for one in covers.values() if one.open is not None), None)
        text = f"There is no other{f' outside of {left} undecided boxes' if left else ''}."
        if opened is not None:
            text = f"The box {shown(opened)} may contain one that is not listed."
        yield Finding(name, "no other rest state", opened is None, text, covers)

    def _cover(self, face: Face | None = None) -> Cover:
        """Cover the range, or a stop: there U may rise outwards."""
        side = 0 if face is None else face.side
        places = {f"s{one.state.number}": one.domain for one in self.checks if one.side == side}
        places |= self.undecided
        box, flat = self.range.box, None
        if face is not None:
            box, flat = flattened(box, 1), (1, face.place)
            places = {
                name: flattened(one, 1)
                for name, one in places.items()
                if arb(one[1][0]) <= face.place <= arb(one[1][1]) or name[0] == "s"
            }
        jumps = bool(self.U.steps) and not self.U.free and face is None

        def reason(part: Box) -> str | None:
            for name, place in places.items():
                if within(part, place):
                    return name
            over = Bounds(self.U, part, flat)
            if face is not None and over.normal * face.side > 0:
                return "f"
            found = over.excludes_zero()
            return no_rest_along_a_jump(self.U, part) if found is None and jumps else found

        return cover(box, reason)._replace(places=places)

    def places_but(self, state: State) -> dict[str, Box]:
        """Return boxes with all rest states but one, by name."""
        others = {one.name: one.enclosure for one in self.states if one is not state}
        return others | {f"undecided box {name[1:]}": b for name, b in self.undecided.items()}
