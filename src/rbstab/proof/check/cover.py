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


def halves(box: Box) -> tuple[int, Box, Box]:
    """Return the axis along which a box is widest, and its halves along it."""
    axis = max(range(len(box)), key=lambda i: box[i][1] - box[i][0])
    a, b = box[axis]
    m = a / 2 + b / 2
    before, after = box[:axis], box[axis + 1 :]
    return axis, (*before, (a, m), *after), (*before, (m, b), *after)


def within(box: Box, outer: Box) -> bool:
    """Return whether a box lies in another."""
    return all(c <= a and b <= d for (a, b), (c, d) in zip(box, outer, strict=True))


def touches(box: Box, other: Box) -> bool:
    """Return whether two boxes have a point in common."""
    return all(a <= d and c <= b for (a, b), (c, d) in zip(box, other, strict=True))


def gap(box: Box, other: Box) -> float:
    """Return the largest distance of two boxes along an axis; 0 if they touch."""
    return max(0.0, *(max(c - b, a - d) for (a, b), (c, d) in zip(box, other, strict=True)))


def wider(box: Box, by: float) -> Box:
    """Return a box with a margin on all sides."""
    return tuple((a - by, b + by) for a, b in box)


def flattened(box: Box, axis: int) -> Box:
    """Return a box without its width along an axis."""
    return (*box[:axis], (0.0, 0.0), *box[axis + 1 :])


def cover(box: Box, reason: Reason, limit: int = BOX_LIMIT) -> Cover:
    """Halve a box until each part is settled, up to a number of boxes."""
    pending, tree = [box], list[str]()
    while pending:
        part = pending.pop()
        found = reason(part)
        if found is not None:
            tree.append(found)
            continue
        if width(part) < MIN_WIDTH or len(tree) >= limit:
            return Cover(box, tree, len(tree), part)
        axis, lower, upper = halves(part)
        tree.append(str(axis + 1))
        pending += [upper, lower]
    return Cover(box, tree, len(tree), None)


class _Part:
    """A part of a flooded box: not examined, halved along an axis, or settled with a reason."""

    def __init__(self, box: Box) -> None:
        self.box = box
        self.reason: str | None = None
        self.axis = 0
        self.halves: tuple[_Part, ...] = ()
        self.flooded = False


def flood(
    box: Box, start: Box, reason: Reason, obstacle: Callable[[Box], str | None]
) -> tuple[Cover, str | None]:
    """Flood a box from a start, over all wet parts that touch each other.

    Args:
        box: The box.
        start: All wet parts that touch it are flooded first.
        reason: Returns why a part is dry, or `WET`; None to halve it.
        obstacle: Returns why a wet part may not be flooded, or None.

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
            if part.halves:
                pending += part.halves
                continue
            if part.reason is None:
                examined += 1
                part.reason = reason(part.box)
                if part.reason is None:
                    if width(part.box) < MIN_WIDTH or examined >= FLOOD_LIMIT:
                        return Cover(box, _tree(whole), examined, part.box), TOO_MANY
                    part.axis, *both = halves(part.box)
                    part.halves = tuple(map(_Part, both))
                    pending += part.halves
                    continue
            if part.reason == WET:
                part.flooded = True
                stopped = obstacle(part.box)
                if stopped is not None:
                    return Cover(box, _tree(whole), examined, part.box), stopped
                reached.append(part.box)
    return Cover(box, _tree(whole), examined, None, {"start": start}), None


def _tree(whole: _Part) -> list[str]:
    pending: list[_Part] = [whole]
    tree = list[str]()
    while pending:
        part = pending.pop()
        if part.halves:
            tree.append(str(part.axis + 1))
            pending += reversed(part.halves)
        else:
            tree.append(part.reason or APART)
    return tree


def disjoint(boxes: Iterable[Box]) -> bool:
    """Return whether no two boxes have a point in common."""
    listed = list(boxes)
    return not any(touches(a, b) for k, a in enumerate(listed) for b in listed[:k])
