"""Covers and floods: a box is halved until each part is settled."""

from collections.abc import Callable, Iterable

from rbstab.proof.check.findings import Box, Cover

BOX_LIMIT = 100_000
FLOOD_LIMIT = 20_000
"""Boxes of one flood."""

MIN_WIDTH = 1e-9
"""rad: narrower boxes are not halved again."""

Reason = Callable[[Box], str | None]
"""Returns the reason why a box is settled, or None."""

TOO_MANY = "the rest: that takes too many boxes"
"""Why a flood stopped at its limit."""

WET = "w"
APART = "a"
"""The reason of a box that a flood does not reach."""


def width(box: Box) -> float:
    """Return the largest width of a box."""
    return max(b - a for a, b in box)


def within(box: Box, outer: Box) -> bool:
    """Return whether a box lies in another."""
    return all(c <= a and b <= d for (a, b), (c, d) in zip(box, outer, strict=True))


def gap(box: Box, other: Box) -> float:
    """Return the largest distance of two boxes along an axis; 0 if they touch."""
    return max(0.0, *(max(c - b, a - d) for (a, b), (c, d) in zip(box, other, strict=True)))


def touches(box: Box, other: Box) -> bool:
    """Return whether two boxes have a point in common."""
    # A flood asks millions of times: a loop is three times as fast as `all`.
    for (a, b), (c, d) in zip(box, other, strict=True):  # noqa: SIM110
        if a > d or c > b:
            return False
    return True


def wider(box: Box, by: float) -> Box:
    """Return a box with a margin on all sides."""
    return tuple((a - by, b + by) for a, b in box)


def flattened(box: Box, axis: int) -> Box:
    """Return a box without its width along an axis."""
    return (*box[:axis], (0.0, 0.0), *box[axis + 1 :])


def disjoint(boxes: Iterable[Box]) -> bool:
    """Return whether no two boxes have a point in common."""
    listed = list(boxes)
    return not any(touches(a, b) for k, a in enumerate(listed) for b in listed[:k])


class _Part:
    """A part of a box: not examined, halved along an axis, or settled with a reason."""

    def __init__(self, box: Box) -> None:
        self.box, self.reason, self.flooded = box, APART, False
        self.halves = list[_Part]()

    def halve(self) -> None:
        """Halve it where it is widest."""
        axis = max(range(len(self.box)), key=lambda i: self.box[i][1] - self.box[i][0])
        a, b = self.box[axis]
        m, before, after = a / 2 + b / 2, self.box[:axis], self.box[axis + 1 :]
        self.reason = str(axis + 1)
        self.halves = [_Part((*before, side, *after)) for side in ((a, m), (m, b))]

    @property
    def tree(self) -> list[str]:
        """The reasons of all parts, in the order of a walk."""
        pending, tree = [self], list[str]()
        while pending:
            part = pending.pop()
            tree.append(part.reason)
            pending += reversed(part.halves)
        return tree


def cover(box: Box, reason: Reason, limit: int = BOX_LIMIT, narrowest: float = MIN_WIDTH) -> Cover:
    """Halve a box until each part is settled, up to a number of boxes, or down to a width.

    Args:
        box: The box.
        reason: Returns the reason why a box is settled, or None.
        limit: The most boxes that are examined.
        narrowest: A box narrower than this is not halved: its claim is refused.
    """
    return flood(box, box, reason, lambda _: None, limit, narrowest=narrowest)[0]


def flood(  # noqa: PLR0913 (a box, where to begin, what to ask; two limits)
    box: Box,
    start: Box,
    reason: Reason,
    obstacle: Reason,
    limit: int = FLOOD_LIMIT,
    *,
    narrowest: float = MIN_WIDTH,
) -> tuple[Cover, str | None]:
    """Flood a box from a start, over all wet parts that touch each other.

    Args:
        box: The box.
        start: All parts that touch it are examined first.
        reason: Returns why a part is dry, or `WET`; None to halve it.
        obstacle: Returns why a wet part may not be flooded, or None.
        limit: The most boxes.
        narrowest: Boxes of a smaller width are not halved, rad.

    Returns:
        The cover of the box, and why the flood stopped before its end; None if it did not.
    """
    whole, examined, reached = _Part(box), 0, [start]
    while reached:
        source, pending = reached.pop(), [whole]
        while pending:
            part = pending.pop()
            if part.flooded or not touches(part.box, source):
                continue
            if part.reason == APART:
                examined += 1
                settled = reason(part.box)
                if settled is None and (width(part.box) < narrowest or examined > limit):
                    return Cover(box, whole.tree, examined, part.box), TOO_MANY
                if settled is None:
                    part.halve()
                else:
                    part.reason = settled
            pending += reversed(part.halves)
            if part.reason == WET:
                part.flooded = True
                stopped = obstacle(part.box)
                if stopped is not None:
                    return Cover(box, whole.tree, examined, part.box), stopped
                reached.append(part.box)
    return Cover(box, whole.tree, examined, None), None
