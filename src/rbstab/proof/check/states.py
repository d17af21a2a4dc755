"""The rest states of a range: each is isolated, and there are no others.

One is an enclosure of one zero of ∇U, or where a stop or a jump holds the body.

Where a force jumps at h = 0, U is L(Θ, λ) with λ in place of the step. If U has slopes of opposite
signs across this surface, on its two sides, all rest states have h = 0 and ∂L/∂Θ = 0 with
0 < λ < 1.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from rbstab.proof.check.bounds import Bounds, Face
from rbstab.proof.check.cover import cover, disjoint, flattened, wider, within
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import Box, Cover, Finding, RefusedError, shown
from rbstab.proof.check.ranges import Range, box_of

SHRINK = [0.5 * 0.7**k for k in range(60)]
"""rad: margins about an enclosure that are tried for its domain."""

AROUND_UNDECIDED = 1e-6
"""rad: the cover leaves out so much about undecided boxes, so that it ends."""

MOST_PLACES = 1000
"""The most rest states and undecided boxes of a range."""


@dataclass(frozen=True)
class State:
    """A claim of one rest state.

    Attributes:
        U: The energy.
        number: Its number, from 1 on.
        enclosure: A box that contains no other rest state.
        index: Its index; None if it is not claimed.
        at_jump: Whether it is where a force jumps.
        ridge: Whether the force pushes away there.
        face: The face of a stop that holds the body: then it is a zero of ∇U along it, on which U
            falls outwards. None without one.
    """

    U: Energy
    number: int
    enclosure: Box
    index: int | None
    at_jump: bool
    ridge: bool
    face: Face | None

    @property
    def name(self) -> str:
        """Its name in sentences."""
        return f"rest state {self.number}"

    def fault(self, range_: Range) -> str | None:
        """Return what is wrong with the claims; None if they are verified."""
        name, over = f"Rest state {self.number}", self._bounds(self.enclosure)
        inner = self.enclosure if self.face is None else flattened(self.enclosure, self.face.axis)
        if not range_.contains(inner):
            return f"{name}: its enclosure is not inside the range."
        if over is None or not (self.face is None or over.outwards(self.face) < 0):
            return f"{name}: its enclosure may contain more than one."
        if not over.contains_zero():
            return f"{name}: none could be shown in its enclosure."
        index = None if over.index is None else over.index + self.ridge
        if self.index is not None and index != self.index:
            return f"{name}: its index is {'not known' if index is None else index}."
        return None

    def _bounds(self, box: Box) -> Bounds | None:
        """Return bounds over a box where all rest states are zeros of its system, or None."""
        over = Bounds(self.U, box, self.face)
        if self.at_jump and len(over.jumps) == 1:
            share = over.share_at_rest(ridge=self.ridge)
            return None if share is None else Bounds(self.U, box, self.face, share)
        return None if self.at_jump or self.ridge or over.jumps else over

    def _has_no_other(self, box: Box) -> bool:
        over = self._bounds(box)
        return over is not None and over.is_injective()

    @cached_property
    def domain(self) -> Box:
        """A box about the enclosure in which there is no other rest state."""
        boxes = (wider(self.enclosure, margin) for margin in SHRINK)
        return next(filter(self._has_no_other, boxes), self.enclosure)


def states_of(U: Energy, claims: Any, range_: Range) -> list[State]:
    """Return the rest states that are claimed.

    Args:
        U: The energy.
        claims: What the record claims of the range: its rest states, and boxes that are undecided.
        range_: The range.

    Raises:
        RefusedError: They cannot be read.
    """
    listed: Sequence[Any] = claims["states"]
    if len(listed) + len(claims.get("undecided", [])) > MOST_PLACES:
        raise RefusedError(f"there are more than {MOST_PLACES} rest states and undecided boxes")
    states = list[State]()
    for number, claim in enumerate(listed, start=1):
        box, index, held = box_of(claim["enclosure"]), claim["index"], bool(claim.get("held"))
        if not (index is None or (type(index) is int and 0 <= index <= 3)):
            raise RefusedError("an index is no number from 0 to 3")
        face = next((face for face in range_.held_at if held and face.meets(box)), None)
        at_jump = held and face is None
        states.append(State(U, number, box, index, at_jump, bool(claim.get("ridge")), face))
    return states


class Listed:
    """The rest states of a range that a proof claims, and boxes that it leaves undecided.

    Args:
        U: The energy.
        claims: The claims.
        range_: The range.
    """

    def __init__(self, U: Energy, claims: Any, range_: Range) -> None:
        self.U, self.range = U, range_
        self.states = states_of(U, claims, range_)
        undecided = [box_of(corners) for corners in claims.get("undecided", [])]
        self.undecided = {
            f"u{k}": wider(box, AROUND_UNDECIDED) for k, box in enumerate(undecided, start=1)
        }
        self.complete = claims["complete"] is True

    def findings(self) -> Iterator[Finding]:
        """Check that each is isolated, and that there is no other."""
        name, left = self.range.name, len(self.undecided)
        wrong = [fault for state in self.states if (fault := state.fault(self.range)) is not None]
        if not disjoint(state.enclosure for state in self.states):
            wrong.append("Two enclosures have a point in common.")
        if self.complete and left:
            wrong.append("The rest states are said to be all, but some boxes are undecided.")
        text = f"{len(self.states)} are isolated, each in its enclosure."
        yield Finding(name, "rest states", not wrong, " ".join(wrong) or text)
        covers = {"range": self._cover()}
        covers |= {face.name: self._cover(face) for face in self.range.held_at}
        opened = next((c.open for c in covers.values() if c.open is not None), None)
        text = f"There is no other{f' outside of {left} undecided boxes' if left else ''}."
        if opened is not None:
            text = f"The box {shown(opened)} may contain one that is not listed."
        yield Finding(name, "no other rest state", opened is None, text, covers)

    def _cover(self, face: Face | None = None) -> Cover:
        """Cover the range, or a stop: there U may rise outwards."""
        places = {f"s{state.number}": state.domain for state in self.states if state.face is face}
        places |= self.undecided
        box = self.range.box
        if face is not None:
            box = flattened(box, face.axis)
            places = {
                name: flattened(place, face.axis)
                for name, place in places.items()
                if face.meets(place)
            }

        def reason(part: Box) -> str | None:
            for name, place in places.items():
                if within(part, place):
                    return name
            over = Bounds(self.U, part, face)
            if face is not None and over.outwards(face) > 0:
                return "f"
            return over.excludes_zero()

        return cover(box, reason)._replace(places=places)

    def places_but(self, state: State) -> dict[str, Box]:
        """Return boxes with all rest states but one, by name."""
        others = {other.name: other.enclosure for other in self.states if other is not state}
        return others | {f"undecided box {name[1:]}": b for name, b in self.undecided.items()}
