"""A flood: all boxes that a connected set about a start may reach.

A box may have a wall: a surface in it that the set does not cross. Then its two sides are cells,
each of which is flooded by itself. Any other box is one cell. What a flooded cell touches is wet
too, is dry, has a wall, or is on the other side of a surface.
"""

from collections.abc import Callable
from typing import NamedTuple

from rbstab.analysis.proof_check.boxes import Box, halves, touches, width
from rbstab.analysis.proof_check.cover import BOX_LIMIT, MIN_WIDTH, Cover

WET = "w"
APART = "a"
"""The reason of a box that no flooded cell reaches. It is not examined."""
WALL = "r"
"""The reason of a box with a wall, followed by the number of the surface, from 1 on."""

Sides = tuple[frozenset[int], ...]
"""On which sides of each surface something is: 1, -1, or both."""


class Flood(NamedTuple):
    """A flood of a box.

    Attributes:
        cover: The cover of the box. What a flooded cell reaches is wet, is dry for a reason, or has
            a wall.
        obstacle: Why the flood stopped before its end; None if it did not.
    """

    cover: Cover
    obstacle: str | None


class Terrain(NamedTuple):
    """What a flood asks of a part of a box.

    Attributes:
        reason: Returns why a part is dry, or `WET`, or `WALL` with a number; None to halve it.
        obstacle: Returns why a cell, given by its box and its sides, may not be flooded, or None.
        sides: Returns on which sides of each surface a part is.
    """

    reason: Callable[[Box], str | None]
    obstacle: Callable[[Box, Sides], str | None]
    sides: Callable[[Box], Sides] = lambda _: ()


class _Part:
    """A part of the box: not examined, halved along `axis`, or settled with a reason.

    Args:
        box: Its box.
        sides: On which sides of each surface it is.

    Attributes:
        cells: The cells that are not flooded yet, by their sides. A dry part has none; one with a
            wall has two.
    """

    def __init__(self, box: Box, sides: Sides) -> None:
        self.box, self.sides = box, sides
        self.reason: str | None = None
        self.halves: tuple[_Part, ...] = ()
        self.axis = 0
        self.cells = [sides]

    def settle(self, reason: str | None) -> None:
        """Set the reason, and divide a part with a wall into its two cells."""
        self.reason = reason
        if reason is None or reason == WET:
            return
        self.cells = []
        if reason.startswith(WALL):
            place = int(reason.removeprefix(WALL)) - 1
            before, after = self.sides[:place], self.sides[place + 1 :]
            self.cells = [(*before, frozenset({sign}), *after) for sign in (-1, 1)]

    def take_cells_meeting(self, sides: Sides) -> list[Sides]:
        """Return the cells that may be on these sides, and take them out of `cells`."""
        found = [one for one in self.cells if meet(one, sides)]
        self.cells = [one for one in self.cells if one not in found]
        return found


def flood(box: Box, start: Box, terrain: Terrain, stretch: float = 1.0) -> Flood:
    """Flood a box from a start, over all parts that touch each other and are wet.

    Args:
        box: The box.
        start: A box; all wet parts that touch it are flooded first.
        terrain: What is asked of a part.
        stretch: As for `halves`.
    """
    reason, obstacle, sides = terrain
    whole, examined = _Part(box, sides(box)), 0
    reached = [(start, sides(start))]
    while reached:
        source, from_sides = reached.pop()
        pending = [whole]
        while pending:
            part = pending.pop()
            if not part.cells or not touches(part.box, source) or not meet(part.sides, from_sides):
                continue
            if not part.halves and part.reason is None:
                examined += 1
                part.settle(reason(part.box))
                if part.reason is None:
                    if width(part.box) < MIN_WIDTH or examined >= BOX_LIMIT:
                        return Flood(_so_far(whole, examined, part), "too many boxes")
                    part.axis, *both = halves(part.box, stretch)
                    part.halves = tuple(_Part(half, sides(half)) for half in both)
            if part.reason is None:
                pending += part.halves
                continue
            for cell in part.take_cells_meeting(from_sides):
                stopped = obstacle(part.box, cell)
                if stopped is not None:
                    return Flood(_so_far(whole, examined, part), stopped)
                reached.append((part.box, cell))
    return Flood(Cover(box, _tree(whole), examined, None, {"start": start}), None)


def name_of_sides(sides: Sides) -> str:
    """Return the end of the name of a cell: the surfaces of which one side alone is in it."""
    pairs = ((number, *one) for number, one in enumerate(sides, start=1) if len(one) == 1)
    return "".join(f", h{number} {'>' if sign > 0 else '<'} 0" for number, sign in pairs)


def _so_far(whole: _Part, examined: int, part: _Part) -> Cover:
    """Return the cover of a flood that stops at a part."""
    return Cover(whole.box, _tree(whole), examined, part.box)


def meet(one: Sides, other: Sides) -> bool:
    """Return whether what is on some sides may be on others too."""
    return all(some & others for some, others in zip(one, other, strict=True))


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
