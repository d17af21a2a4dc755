"""One rest state: its enclosure contains exactly one zero of ∇U, or a stop holds the body there."""

from dataclasses import dataclass
from functools import cached_property

from flint import arb

from rbstab.proof.check.bounds import Bounds
from rbstab.proof.check.cover import wider
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import Box
from rbstab.proof.check.least import bounds
from rbstab.proof.check.ranges import Face, Range

SHRINK = [0.5 * 0.7**k for k in range(60)]
"""rad: margins about an enclosure that are tried for its domain."""


@dataclass(frozen=True)
class State:
    """What is claimed of one rest state."""

    number: int
    enclosure: Box
    index: int | None
    held: bool
    ridge: bool

    @property
    def name(self) -> str:
        """Its name in sentences."""
        return f"rest state {self.number}"


class Isolated:
    """A rest state that is checked: whether its enclosure contains exactly one zero of ∇U.

    Args:
        U: The energy.
        state: What is claimed.
        range_: The range.
    """

    def __init__(self, U: Energy, state: State, range_: Range) -> None:
        self.U, self.state, self.range = U, state, range_

    @property
    def fault(self) -> str | None:
        """What is wrong with the claims; None if they are verified."""
        name = f"Rest state {self.state.number}"
        if not self._is_inside:
            return f"{name}: its enclosure is not inside the range."
        if not self._is_unique:
            return f"{name}: its enclosure may contain more than one."
        if not self._exists:
            return f"{name}: none could be shown in its enclosure."
        index = self._index
        if self.state.index is not None and index != self.state.index:
            return f"{name}: its index is {'not known' if index is None else index}."
        return None

    @property
    def _is_inside(self) -> bool:
        return self.range.contains(self.state.enclosure)

    @cached_property
    def _bounds(self) -> Bounds:
        return bounds(self.U, self.state.enclosure)

    @property
    def _is_unique(self) -> bool:
        return not self.state.ridge and self._bounds.one_to_one()

    @property
    def _exists(self) -> bool:
        return self._bounds.contains_zero(self.state.enclosure)

    @property
    def _index(self) -> int | None:
        return self._bounds.index

    def _has_no_other(self, box: Box) -> bool:
        """Return whether a box about the enclosure contains no other rest state."""
        return bounds(self.U, box).one_to_one()

    @cached_property
    def domain(self) -> Box:
        """A box about the enclosure in which there is no other rest state."""
        for margin in SHRINK:
            box = wider(self.state.enclosure, margin)
            if self._has_no_other(box):
                return box
        return self.state.enclosure


class AtStop(Isolated):
    """A rest state that a stop holds: a zero of ∇U along the face, on which U falls outwards."""

    @cached_property
    def face(self) -> Face:
        """The face."""
        side = 0 if self.state.enclosure[1][0] < 0 else 1
        return list(self.range.faces(1))[side]

    @property
    def _is_inside(self) -> bool:
        low, high = self.state.enclosure[1]
        place = self.face.place
        box = (self.state.enclosure[0], (0.0, 0.0), self.state.enclosure[2])
        on_face = bool(arb(low) <= place <= arb(high)) or bool(place.overlaps(arb(low)))
        return on_face and self.range.contains(box)

    @cached_property
    def _bounds(self) -> Bounds:
        return bounds(self.U, self.state.enclosure, (1, self.face.place))

    @property
    def _is_unique(self) -> bool:
        held = self._bounds.normal * self.face.side < 0
        return bool(held) and not self.state.ridge and self._bounds.one_to_one()

    def _has_no_other(self, box: Box) -> bool:
        return bounds(self.U, box, (1, self.face.place)).one_to_one()
