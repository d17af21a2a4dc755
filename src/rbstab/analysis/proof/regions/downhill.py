"""Paths from a point down to a minimum, proved to stay below a level of the reduced energy."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rbstab.analysis.proof.boxes import Boxes, joined, whole_range
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.guards.kinks import Kink, kink_at, kinks_of
from rbstab.analysis.proof.least_value import upper_bounds
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

MAX_STEP = 0.1
"""rad: the longest step of a descent, so that its straight steps stay below their ends."""

MAX_STEPS = 1000
WIDTHS = tuple(10.0**-k for k in range(2, 11))
"""The widths of smooth energies near U, relative to its size."""

SAME_POINT = 1e-6
"""rad: a descent that ends closer than this to a minimum has reached it."""

INNER = 1 - 1e-9
"""Ways down stay in the range times this."""

STOP_MARGIN = 1e-14
"""rad: more than the last digit of the angle of a stop."""

MAX_HALVINGS = 40
PATH_BOX_LIMIT = 20_000
MIN_CURVATURE_FRACTION = 1e-8
"""Smaller curvatures, relative to the largest, count as this much in a Newton step."""


@dataclass(frozen=True, eq=False)
class Landscape:
    """An energy with its minima, and the range in which ways down to them are searched.

    form is U. minima are the enclosures of the minima; a minimum is known by its index in them. The
    range is -end <= Θ <= end; ways down stay in `domain`, one box inside it.
    """

    form: TrigonometricForm
    minima: tuple[Boxes, ...]
    end: Array

    @property
    def domain(self) -> Boxes:
        """The range, a little smaller, because π and π/2 are rounded outwards; up to a stop."""
        inner = INNER * self.end
        guard = self.form.guard
        if guard is not None and guard.stop is not None:
            # Beyond a stop the form has values, but nothing can be there.
            inner[1] = min(self.end[1], guard.end)
        return whole_range(inner)

    def reached_minimum(self, start: Boxes, level: float) -> int | None:
        """Return a minimum that is joined to a box by a path in {U < level}, proved.

        The path is a chain of boxes in the domain. U is below the level in each of them, and each
        has a point in common with the next. So they lie in one component of {U < level}.

        Args:
            start: One box, in which the path begins. All of it must be below the level.
            level: The level, J.

        Returns:
            The minimum; None if no path is found or its proof fails.
        """
        # The widest smooth energy may slide over a ridge; the narrowest one may get stuck on it.
        for widths in (WIDTHS[-1:], WIDTHS) if self.form.kinks else (WIDTHS,):
            vertices = descent(self.form, start.centre[0], self.domain, widths)
            ends = [np.abs(vertices[-1] - minimum.centre[0]).max() for minimum in self.minima]
            if not ends or min(ends) > SAME_POINT:
                continue
            reached = int(np.argmin(ends))
            path = np.concatenate([vertices, self.minima[reached].centre])
            both_ends = joined([start, self.minima[reached]])
            if stays_below(self.form, path, both_ends, level, self.domain):
                return reached
        return None


@np.errstate(all="ignore")  # comparisons with NaN are false
def descent(
    form: TrigonometricForm, start: Array, domain: Boxes, widths: Sequence[float] = WIDTHS
) -> Array:
    """Descend from a point by short Newton steps, away from saddles, shape (vertices, 3).

    Where a guard jumps, a step ends at its angle; the next one goes along it if the guard can hold
    θ2 there. Where elements of users jump, the descent is one in smooth energies near U, of the
    given widths. It ends where it leaves the domain or finds no lower point. Nothing is proved.
    """
    if not form.kinks:
        return _descent(form, start, domain)
    size = form.noise[0] / np.finfo(float).eps
    path = start[np.newaxis]
    for width in widths:
        path = np.concatenate([path, _descent(form.smoothed(width * size), path[-1], domain)])
    return path


def _descent(form: TrigonometricForm, start: Array, domain: Boxes) -> Array:
    """Descend in an energy whose slopes jump at angles of θ2 alone."""
    Theta, vertices = start, [start]
    value = form.value(Theta[np.newaxis])[0]
    for _ in range(MAX_STEPS):
        kink = kink_at(form.guard, float(Theta[1]))
        step = _newton_step(form, Theta) if kink is None else _step_from_kink(form, kink, Theta)
        length = float(np.abs(step).max())
        step *= min(1.0, MAX_STEP / length) if length > 0 else 0.0
        for _ in range(MAX_HALVINGS):
            end = _until_kink(form, Theta, Theta + step)
            reached = form.value(end[np.newaxis])[0]
            lower = reached < value
            if lower:
                break
            step = 0.5 * step
        if not lower:
            break
        Theta, value = end, reached
        vertices.append(Theta)
        if np.any(domain.low[0] > Theta) or np.any(domain.high[0] < Theta):
            break
    return np.array(vertices)


def _newton_step(form: TrigonometricForm, Theta: Array, axes: Sequence[int] = (0, 1, 2)) -> Array:
    """Return a step down along some axes, by the sizes of the curvatures."""
    _, gradient, hessian = form.approximate(Theta[np.newaxis], 2)
    chosen = np.array(axes)
    size, directions = np.linalg.eigh(hessian[0][np.ix_(chosen, chosen)])
    size = np.maximum(np.abs(size), MIN_CURVATURE_FRACTION * np.abs(size).max())
    step = np.zeros(3)
    step[chosen] = -directions @ ((directions.T @ gradient[0][chosen]) / size)
    return step


def _step_from_kink(form: TrigonometricForm, kink: Kink, Theta: Array) -> Array:
    """Return a step from an angle at which a guard jumps: along it, or to one of its sides."""
    smooth = kink.smooth(form)
    slope = smooth.approximate(Theta[np.newaxis], 1)[1][0, 1]
    along = _newton_step(smooth, Theta, (0, 2))
    if kink.holds(slope):
        return along
    # A step beyond the guard is one of the energy with its slope there.
    outwards = -kink.side * slope > 0
    beyond = replace(smooth, linear=smooth.linear + kink.slope_beyond) if outwards else smooth
    step = _newton_step(beyond, Theta)
    # The other two angles may turn a step towards the side that is not meant.
    return step if (kink.side * step[1] > 0) == outwards else along


def _until_kink(form: TrigonometricForm, begin: Array, end: Array) -> Array:
    """Return the end of a step, or the first point of it at which a guard jumps."""
    for kink in kinks_of(form.guard):
        starts_there = kink_at(form.guard, float(begin[1])) == kink
        if not starts_there and (begin[1] - kink.angle) * (end[1] - kink.angle) < 0:
            end = begin + (kink.angle - begin[1]) / (end[1] - begin[1]) * (end - begin)
            end[1] = kink.angle
    return end


@np.errstate(all="ignore")  # comparisons with NaN are false
def stays_below(
    form: TrigonometricForm, path: Array, ends: Boxes, level: float, domain: Boxes
) -> bool:
    """Return whether a chain of boxes along a path is proved to lie in {U < level} and the domain.

    A box that may reach the level is replaced by two smaller ones about the halves of its part of
    the path. Only the vertices matter: halving rounds the path, and moves it a little.

    Args:
        form: U.
        path: The vertices, shape (n, 3).
        ends: Further boxes that must be below the level, such as one about each end.
        level: The level, J.
        domain: One box.
    """
    if not np.all(ends.within(domain)) or not _all_below(form, ends, level):
        return False
    begin, end, examined = path[:-1], path[1:], 0
    for _ in range(MAX_HALVINGS):
        boxes = Boxes(np.minimum(begin, end), np.maximum(begin, end))
        examined += len(boxes)
        if examined > PATH_BOX_LIMIT or not np.all(boxes.within(domain)):
            return False
        left = ~(_upper(form, boxes) < level)
        if not np.any(left):
            return True
        begin, end = begin[left], end[left]
        middle = 0.5 * (begin + end)
        begin, end = np.concatenate([begin, middle]), np.concatenate([middle, end])
    return False


def _all_below(form: TrigonometricForm, boxes: Boxes, level: float) -> bool:
    """Return whether U is below a level in all of some boxes, proved; wide boxes are halved."""
    examined = 0
    while len(boxes):
        examined += len(boxes)
        if examined > PATH_BOX_LIMIT or np.any(form.value(boxes.centre) >= level):
            return False
        boxes = boxes[~(_upper(form, boxes) < level)]
        boxes = boxes.halves(boxes.radius.argmax(axis=1))
    return True


def _upper(form: TrigonometricForm, boxes: Boxes) -> Array:
    """Bound U from above over boxes.

    θ2 of a stop is rounded: a way along it lies a little beyond, or inside. So the boxes are a
    little wider there, and contain the same way at the exact θ2.
    """
    if form.guard is not None and form.guard.stop is not None:
        margin = np.array([0.0, STOP_MARGIN, 0.0])
        boxes = Boxes(boxes.low - margin, boxes.high + margin)
    return upper_bounds(enclosure(form, boxes))
