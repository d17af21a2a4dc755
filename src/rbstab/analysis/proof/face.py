"""The ends of the range of Θ."""

from enum import Enum

import numpy as np

from rbstab.analysis.proof.boxes import RANGE_END, Boxes
from rbstab.mechanics.numbers import Array


class Face(Enum):
    """One end of the range of Θ: the axis and the sign of its angle."""

    THETA1_LOW = (0, -1)
    THETA1_HIGH = (0, 1)
    THETA2_LOW = (1, -1)
    THETA2_HIGH = (1, 1)
    THETA3_LOW = (2, -1)
    THETA3_HIGH = (2, 1)

    @property
    def box(self) -> Boxes:
        """The face of the range of eq. 5 as a box."""
        return self.box_of(RANGE_END)

    def box_of(self, end: Array) -> Boxes:
        """Return the face of the range -end <= Θ <= end as a box that is thin along its axis.

        π and π/2 are no doubles, so the box is not flat.
        """
        axis, sign = self.value
        low, high = -end, end.copy()
        outer, inner = sign * end[axis], sign * np.nextafter(end[axis], 0)
        low[axis], high[axis] = min(outer, inner), max(outer, inner)
        return Boxes(low[np.newaxis], high[np.newaxis])
