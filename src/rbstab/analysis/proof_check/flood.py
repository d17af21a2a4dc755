"""A flood: all boxes that a connected set about a start may reach. All next to them are dry."""

from collections.abc import Callable
from typing import NamedTuple

from rbstab.analysis.proof_check.boxes import Box, halves, touches, width
from rbstab.analysis.proof_check.cover import BOX_LIMIT, MIN_WIDTH, Cover

WET = "w"
APART = "a"
"""The reason of a box that touches no wet box. It is not examined."""


class Flood(NamedTuple):
    """A flood of a box.

    Attributes:
        cover: The cover of the box. Boxes that touch a wet one are wet or dry, for a reason.
        obstacle: Why the flood stopped before its end; None if it did not.
    """

    cover: Cover
    obstacle: str | None


class _Part:
    """A part of the box; halved along `axis` once `halves` has two, examined with a reason."""

    def __init__(self, box: Box) -> None:
        self.box = box
        self.reason: str | None = None
        self.halves: tuple[_Part, ...] = ()
        self.axis = 0


def flood(
    box: Box,
    start: Box,
    reason: Callable[[Box], str | None],
    obstacle: Callable[[Box], str | None],
    stretch: float = 1.0,
) -> Flood:
    """Flood a box from a start, over all parts that touch each other and are wet.

    Args:
        box: The box.
        start: A box; all wet parts that touch it are flooded first.
        reason: Returns why a part is dry, or `WET`; None to halve it.
        obstacle: Returns why a wet part is not allowed, or None.
        stretch: As for `halves`.
    """
    whole, examined = _Part(box), 0
    reached = [start]
    while reached:
        source = reached.pop()
        pending = [whole]
        while pending:
            part = pending.pop()
            if part.reason is not None or not touches(part.box, source):
                continue
            if not part.halves:
                examined += 1
                part.reason = reason(part.box)
                stopped = obstacle(part.box) if part.reason == WET else None
                if part.reason is None:
                    if width(part.box) < MIN_WIDTH or examined >= BOX_LIMIT:
                        stopped = "too many boxes"
                    part.axis, *both = halves(part.box, stretch)
                    part.halves = tuple(_Part(half) for half in both)
                if stopped is not None:
                    return Flood(Cover(box, _tree(whole), examined, part.box), stopped)
                if part.reason == WET:
                    reached.append(part.box)
            pending += part.halves
    return Flood(Cover(box, _tree(whole), examined, None, {"start": start}), None)


def _tree(whole: _Part) -> list[str]:
    """Return the tree of a cover."""
    pending, tree = [whole], list[str]()
    while pending:
        part = pending.pop()
        if part.halves:
            tree.append(str(part.axis + 1))
            pending += reversed(part.halves)
        else:
            tree.append(part.reason or APART)
    return tree
