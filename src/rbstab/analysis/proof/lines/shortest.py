"""A proved lower bound on the square of a line's length, by branch and bound over all attitudes."""

import numpy as np

from rbstab.analysis.proof.boxes import PI, Boxes, joined
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.least_value import lower_bounds
from rbstab.analysis.proof.lines.line import Line
from rbstab.analysis.proof.trigonometric import TrigonometricForm

BOX_LIMIT = 100_000
"""The number of boxes at which the search stops."""

FRACTION = 0.5
"""The bound is at least this fraction of the least s that was seen: enough for all that follows."""


class NoLength(Exception):
    """It is not proved that a line has a length at each attitude: it may have none."""


def line_of(weight: float, square: TrigonometricForm) -> Line:
    """Return the energy of a line.

    Args:
        weight: w, N.
        square: s, m², periodic in all angles.

    Raises:
        NoLength: s may be zero.
    """
    return Line(square, weight, least_square(square))


@np.errstate(all="ignore")  # comparisons with NaN are false
def least_square(square: TrigonometricForm) -> float:
    """Return a proved lower bound on s at all real Θ, above 0, m².

    s is periodic, so the angles from -π to π are enough, those of θ2 beyond ±π/2 among them.

    Raises:
        NoLength: None is found.
    """
    ends = np.full((1, 3), PI)
    pending, seen, bound, examined = Boxes(-ends, ends), np.inf, np.inf, 0
    while len(pending):
        examined += len(pending)
        if examined > BOX_LIMIT:
            raise NoLength
        enclosed = enclosure(square, pending)
        seen = min(seen, float(enclosed.value.min()))
        lower = lower_bounds(enclosed)
        finished = (lower > 0) & (lower >= FRACTION * seen)
        bound = min(bound, float(lower[finished].min(initial=np.inf)))
        left = pending[~finished]
        pending = joined([left.halves(left.radius.argmax(axis=1))])
    return bound
