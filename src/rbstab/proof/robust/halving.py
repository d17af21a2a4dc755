"""Boxes of Θ that are examined and halved until nothing is left of them."""

from collections.abc import Callable

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Boxes, joined

BOX_LIMIT = 20_000
"""The number of boxes of Θ at which a search for one box of bodies stops."""

IsLate = Callable[[], bool]


@np.errstate(all="ignore")  # comparisons with NaN are false
def halved(
    boxes: Boxes, batch: int, is_left: Callable[[Boxes], Array], is_late: IsLate
) -> tuple[int, Boxes]:
    """Examine boxes in batches, and then what is left of them.

    Args:
        boxes: The boxes.
        batch: So many are examined at once.
        is_left: Returns which boxes of a batch are not done; they are halved along their widest
            axis.
        is_late: Returns whether the search is to be given up.

    Returns:
        The number of boxes that were examined, and the boxes that are not done.
    """
    examined = 0
    while boxes.count and examined < BOX_LIMIT and not is_late():
        some, boxes = boxes[slice(-batch, None)], boxes[slice(0, -batch)]
        examined += some.count
        left = some[is_left(some)]
        boxes = joined([boxes, left.halved((left.hi - left.lo).argmax(axis=0))], 3)
    return examined, boxes
