"""All zeros of the gradient of a reduced energy in the range of eq. 5, by branch and bound.

The range is cut into boxes. A box is done where a bound shows that no zero is in it, or where it
lies in the domain of a known zero, in which there is no other. What is left is halved.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from rbstab.analysis.proof.boxes import Boxes, joined, no_boxes, whole_range
from rbstab.analysis.proof.enclosure import enclosure, inverses
from rbstab.analysis.proof.trigonometric import MAX_ANGLE, TrigonometricForm
from rbstab.analysis.proof.zero import Zero, isolated_zero, newton
from rbstab.mechanics.numbers import Array

BATCH = 2048
"""Boxes that are examined at once."""

BOX_LIMIT = 400_000

MIN_REACH = 1e-7
"""rad: boxes below this are not halved again. A zero that this cannot isolate is a double one, or
all but one."""

STARTS = 64
"""The most points of a batch from which Newton's method looks for zeros."""

ARRIVED = 1e-8
"""rad: the last Newton step where one has arrived; and two points that far apart are tried once."""


class Outcome(Enum):
    """How a search for all zeros ended; the value says it in words."""

    PROVED = "every zero in the range is known"
    UNDECIDED = "some boxes could be neither emptied nor shown to hold one zero"
    BOX_LIMIT = "the limit on the number of boxes was reached"
    SEARCHED = "looked for, not proved"


@dataclass(frozen=True, eq=False)
class Zeros:
    """The zeros of ∇U in the closed range of eq. 5.

    inside are in the open range; outside are those beyond it that were met. Whatever is undecided,
    a box that may hold zeros or the enclosure of one that straddles the border, is in `undecided`.
    """

    inside: tuple[Zero, ...]
    outside: tuple[Zero, ...]
    undecided: Boxes
    examined: int
    outcome: Outcome


@dataclass
class _Search:
    """The state of one branch and bound."""

    form: TrigonometricForm
    zeros: list[Zero] = field(default_factory=list)
    unclear: list[Boxes] = field(default_factory=list)
    refused: list[Array] = field(default_factory=list)

    def note(self, points: Iterable[Array]) -> None:
        """Add the zeros at some points that are not known yet."""
        for Theta in points:
            known = any(zero.owns(Theta) for zero in self.zeros)
            in_vain = any(np.abs(Theta - other).max() < ARRIVED for other in self.refused)
            if known or in_vain or np.any(np.abs(Theta) > MAX_ANGLE):
                continue
            zero = isolated_zero(self.form, Theta)
            if zero is None:
                self.refused.append(Theta)
                continue
            same = [zero.is_the_same_as(other) for other in self.zeros]
            if None in same:
                self.unclear.append(zero.enclosure)
            elif True not in same:
                self.zeros.append(zero)

    def open(self, boxes: Boxes) -> Boxes:
        """The boxes that lie in no domain."""
        for zero in self.zeros:
            boxes = boxes[~boxes.within(zero.domain)]
        return boxes

    def examine(self, boxes: Boxes) -> tuple[Boxes, Array]:
        """The boxes that may hold an unknown zero, and the axis along which to halve each."""
        boxes = self.open(boxes)
        over = enclosure(self.form, boxes)
        left = ~over.monotonic
        boxes, over = boxes[left], over[left]
        bounds = over.preconditioned(inverses(over.hessian))
        left = ~bounds.without_zero
        near = left & np.all(np.abs(bounds.step) <= 2 * bounds.reach, axis=1)
        self.note(_arrived(self.form, boxes.centre[near][:STARTS]))
        for zero in self.zeros:
            left &= ~boxes.within(zero.domain)
        return boxes[left], boxes.reach[left].argmax(axis=1)


@np.errstate(all="ignore")  # no test holds for what is not a number
def prove(
    form: TrigonometricForm, known: Iterable[Array] = (), box_limit: int = BOX_LIMIT
) -> Zeros:
    """Enclose every zero of ∇U in the closed range of eq. 5.

    Args:
        form: U.
        known: Points that may be zeros, each of shape (3,), rad. They save time, and are not
            believed: without them the same zeros are found.
        box_limit: The number of boxes at which to give up.
    """
    search = _Search(form)
    search.note(known)
    waiting, undecided, examined = whole_range(), [], 0
    while len(waiting) and examined < box_limit:
        # The last are the smallest: zeros are found early, and few boxes wait.
        batch, waiting = waiting[-BATCH:], waiting[:-BATCH]
        examined += len(batch)
        left, axis = search.examine(batch)
        small = left.reach.max(axis=1, initial=0.0) < MIN_REACH
        undecided.append(left[small])
        waiting = joined([waiting, left[~small].halves(axis[~small])])
    open_boxes = search.open(joined([no_boxes(), waiting, *undecided]))
    return _sorted_out(search, open_boxes, examined, bool(len(waiting)))


def _sorted_out(search: _Search, undecided: Boxes, examined: int, stopped: bool) -> Zeros:
    whole = whole_range()
    inside = [zero for zero in search.zeros if zero.enclosure.within(whole)[0]]
    outside = [zero for zero in search.zeros if not zero.enclosure.meets(whole)[0]]
    straddling = [zero.enclosure for zero in search.zeros if zero not in [*inside, *outside]]
    undecided = joined([undecided, *straddling, *search.unclear])
    outcome = Outcome.UNDECIDED if len(undecided) else Outcome.PROVED
    return Zeros(
        tuple(inside),
        tuple(outside),
        undecided,
        examined,
        Outcome.BOX_LIMIT if stopped else outcome,
    )


def _arrived(form: TrigonometricForm, starts: Array) -> Array:
    Theta, last = newton(form, starts)
    return Theta[last < ARRIVED]
