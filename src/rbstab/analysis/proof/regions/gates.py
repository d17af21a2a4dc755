"""Gates: the points at which a growing component of {U < c} can first reach something else.

A gate is a rest state that is no minimum, or a point of the border. A component of {U < c} about a
minimum contains no other rest state, and stays away from the border, as long as c is at most the
energy of every gate that does not lead down to other minima only (proofs.md, theorem 5).
"""

from dataclasses import dataclass
from itertools import islice

import numpy as np

from rbstab.analysis.proof.boxes import ROUNDING_FACTOR, Boxes, box_around
from rbstab.analysis.proof.certified_region import Face
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.least_value import lower_bounds, upper_bounds
from rbstab.analysis.proof.regions.downhill import Landscape
from rbstab.analysis.proof.rest_states import RestPoint
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

FIRST_STEPS = np.geomspace(0.5, 1e-5, 12)
"""rad: the lengths that are tried for the first step down from a saddle."""

MAX_DESCENTS = 3
"""So many of these lengths are tried with a whole way down."""


@dataclass(frozen=True, eq=False)
class Gate:
    """A place through which a component of {U < c} may first reach something else.

    energy, J, is about U there, and lower_bound and upper_bound are proved. Theta is the place,
    shape (3,), or None if it is not located. state is the index of a rest state, or face that of
    the border.

    ends are the minima to which all ways down from here lead, proved. None: not proved, so the gate
    may lead to each of them.
    """

    energy: float
    lower_bound: float
    upper_bound: float
    Theta: Array | None
    state: int | None = None
    face: Face | None = None
    ends: frozenset[int] | None = None

    def leads_to(self, minimum: int) -> bool:
        """Return whether this gate may lead down to a minimum."""
        return self.ends is None or minimum in self.ends


def state_gate(form: TrigonometricForm, point: RestPoint, state: int) -> Gate:
    """Return the gate of a proved rest state that is not proved to be a minimum.

    Args:
        form: U.
        point: The rest state.
        state: Its index among the rest states.
    """
    enclosed = enclosure(form, point.enclosure)
    low, high = float(lower_bounds(enclosed)[0]), float(upper_bounds(enclosed)[0])
    return Gate(point.state.energy, low, high, point.Theta, state=state)


def minima_below(landscape: Landscape, point: RestPoint, level: float) -> frozenset[int] | None:
    """Return the minima to which all ways down from a rest state lead; None if not proved.

    Near a rest state of index 1, {U < level} consists of two parts, on both sides along the
    direction of negative curvature. For a larger index it is one part, so one way down is enough.
    Nothing is proved of the ways down from where a force holds the body.
    """
    if not point.index_proved or point.index == 0 or point.state.on_kink:
        return None
    hessian = landscape.form.approximate(point.Theta[np.newaxis], 2)[2][0]
    steepest = np.linalg.eigh(hessian)[1][:, 0]
    ways = [_end(landscape, point, sign * steepest, level) for sign in (1.0, -1.0)]
    found = [end for end in ways if end is not None]
    if len(found) < (2 if point.index == 1 else 1):
        return None
    return frozenset(found)


def _end(landscape: Landscape, point: RestPoint, direction: Array, level: float) -> int | None:
    """Return the minimum to which one way down from a saddle leads; None if it is not proved."""
    steps = (length * direction for length in FIRST_STEPS)
    falling = (step for step in steps if falls_along(landscape.form, point.enclosure, step))
    for step in islice(falling, MAX_DESCENTS):
        # The saddle plus this step lies in a box of the size of the saddle's enclosure.
        reach = 2.0 * point.enclosure.radius[0] + 1e-14
        found = landscape.reached_minimum(box_around(point.Theta + step, reach), level)
        if found is not None:
            return found
    return None


def falls_along(form: TrigonometricForm, saddle: Boxes, step: Array) -> bool:
    """Return whether U falls all along a step from the exact saddle, proved.

    The slope is zero at the saddle. So U falls if d'H(Θ)d < 0 for the step d and all Θ along it.
    """
    along = Boxes(saddle.low + np.minimum(step, 0.0), saddle.high + np.maximum(step, 0.0))
    margin = 1e-14
    enclosed = enclosure(form, Boxes(along.low - margin, along.high + margin))
    size = np.abs(step)
    bend = float(step @ enclosed.hessian[0] @ step)
    error = float(size @ enclosed.hessian_radius[0] @ size)
    error += 1e-14 * float(size @ np.abs(enclosed.hessian[0]) @ size)
    return bend + error * ROUNDING_FACTOR < 0


def undecided_gate(form: TrigonometricForm, undecided: Boxes) -> Gate | None:
    """Return the gate of all boxes that may contain further rest states; None without boxes."""
    if not len(undecided):
        return None
    lowest = float(lower_bounds(enclosure(form, undecided)).min())
    return Gate(lowest, lowest, np.inf, None)
