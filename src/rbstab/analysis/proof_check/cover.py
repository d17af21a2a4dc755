"""A cover of a box by smaller boxes, each with the reason why it is settled."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from rbstab.analysis.proof_check.boxes import Box, halves, width

BOX_LIMIT = 200_000
MIN_WIDTH = 1e-9
"""rad: narrower boxes are not halved again."""


class Cover(NamedTuple):
    """A cover of a box.

    Attributes:
        box: The box.
        tree: The boxes in the order of a walk: the axis ("1" to "3") along which a box is halved
            at its middle, followed by its lower and its upper half; or the reason of a settled box.
        boxes: The number of boxes that were examined.
        open: A box that could not be settled; None if all are settled, so that the cover is proved.
        places: Boxes to which reasons refer, by their names.
    """

    box: Box
    tree: list[str]
    boxes: int
    open: Box | None
    places: Mapping[str, Box] = {}


def cover(
    box: Box,
    reason: Callable[[Box], str | None],
    limit: int = BOX_LIMIT,
    stretch: float = 1.0,
) -> Cover:
    """Halve a box until each part is settled.

    Args:
        box: The box.
        reason: Returns the reason why a box is settled, or None.
        limit: The number of boxes at which to stop.
        stretch: As for `halves`.
    """
    pending, tree = [box], list[str]()
    while pending:
        part = pending.pop()
        found = reason(part)
        if found is not None:
            tree.append(found)
            continue
        if width(part) < MIN_WIDTH or len(tree) >= limit:
            return Cover(box, tree, len(tree), part)
        axis, lower, upper = halves(part, stretch)
        tree.append(str(axis + 1))
        # The last one is taken first.
        pending += [upper, lower]
    return Cover(box, tree, len(tree), None)
