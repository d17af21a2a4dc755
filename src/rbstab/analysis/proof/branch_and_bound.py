"""All zeros of the gradient of a reduced energy in the range of eq. 5, by branch and bound.

The range is divided into boxes. A box is finished if a bound shows that it contains no zero, or
if it lies in the domain of a known zero, which contains no other zero. All other boxes are halved.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

import numpy as np

from rbstab.analysis.proof.box_bounds import Enclosure, inverses
from rbstab.analysis.proof.boxes import RANGE_END, Boxes, joined, no_boxes, whole_range
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.guards.bounds import KinkedEnclosure
from rbstab.analysis.proof.guards.kinks import (
    isolated_kink_zero,
    kink_at,
    kinks_of,
    newton_at_kink,
)
from rbstab.analysis.proof.searches.families import is_family, singular
from rbstab.analysis.proof.traced.held import surface_at, surfaces
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.proof.zero import SHORT_NEWTON_STEPS, Zero, isolated_zero, newton
from rbstab.mechanics.numbers import Array

BATCH = 2048
"""Number of boxes examined at once."""

BOX_LIMIT = 400_000

MIN_RADIUS = 1e-7
"""rad: boxes with a radius below this are not halved again.

A zero that cannot be isolated in such a box is a double zero, or nearly so.
"""

FAMILY_RADIUS = 0.05
"""rad: the same beside a family of zeros, which ever more smaller boxes would cover."""

MAX_STARTS = 64
"""The maximum number of points of a batch from which Newton's method is started."""

NEAR_KINK = 0.1
"""rad: smaller boxes at a kink are starts of Newton's method along it."""

CONVERGED_STEP = 1e-8
"""rad: Newton's method has converged if its last step is below this.

A point closer than this to a point that failed is not tried again.
"""


class Tests(Protocol):
    """Further tests of a search, for a form that allows sharper ones."""

    def isolated(self, Theta: Array) -> Zero | None:
        """Prove that a zero near a point exists and is unique, like `isolated_zero`."""

    def excludes_zero(self, boxes: Boxes, enclosed: Enclosure) -> Array:
        """Return whether each box is proved to have no zero, shape (m,)."""

    def hopeless(self, boxes: Boxes, zeros: list[Zero]) -> bool:
        """Return whether the search cannot succeed with these boxes left; it then ends."""


class SearchOutcome(Enum):
    """How a search for all zeros ended; the value is the text to show."""

    PROVED = "every zero in the range is known"
    UNDECIDED = (
        "in some small parts of the range it could not be decided whether there is a rest state"
    )
    BOX_LIMIT = "the limit on the number of boxes was reached"
    FAMILY = "a continuum (a family) of rest states is suspected, which is not counted"
    SEARCHED = "looked for, not proved"


@dataclass(frozen=True, eq=False)
class Zeros:
    """The zeros of ∇U in the closed range of eq. 5, or in another box.

    inside are in the open range; outside are zeros found beyond it. undecided holds the boxes that
    may contain further zeros, and the enclosures of zeros that straddle the border. covered is the
    share of the range, by volume, that the search has finished.
    """

    inside: tuple[Zero, ...]
    outside: tuple[Zero, ...]
    undecided: Boxes
    examined: int
    outcome: SearchOutcome
    covered: float = 1.0


@dataclass
class _Search:
    """The known zeros and the failed attempts of one branch-and-bound search."""

    form: TrigonometricForm
    tests: Tests | None = None
    zeros: list[Zero] = field(default_factory=list)
    ambiguous: list[Boxes] = field(default_factory=list)
    failed: list[Array] = field(default_factory=list)
    family: bool = False

    def add_zeros_at(self, points: Iterable[Array]) -> None:
        """Add the zeros at some points that are not known yet, but for those of a family."""
        for Theta in points:
            if self.family and self._is_singular(Theta):
                continue
            known = any(zero.domain_contains(Theta) for zero in self.zeros)
            failed_before = any(
                np.abs(Theta - other).max() < CONVERGED_STEP for other in self.failed
            )
            if known or failed_before or np.any(np.abs(Theta) > self.form.reach):
                continue
            zero = self._isolated(Theta)
            if zero is None:
                self.failed.append(Theta)
                self.family = self.family or is_family(self.form, self.failed)
                continue
            same = [zero.is_same_as(other) for other in self.zeros]
            if None in same:
                self.ambiguous.append(zero.enclosure)
            elif True not in same:
                self.zeros.append(zero)

    def _is_singular(self, Theta: Array) -> bool:
        return bool(singular(self.form.approximate(Theta[np.newaxis], 2)[2])[0])

    def _isolated(self, Theta: Array) -> Zero | None:
        if self.tests is not None:
            return self.tests.isolated(Theta)
        kink = kink_at(self.form.guard, float(Theta[1]))
        if kink is not None:
            return isolated_kink_zero(self.form, kink, Theta)
        surface = surface_at(self.form, Theta)
        held = None if surface is None else surface.isolated_zero(Theta)
        return isolated_zero(self.form, Theta) if held is None else held

    def outside_domains(self, boxes: Boxes) -> Boxes:
        """Return the boxes that do not lie in the domain of a known zero."""
        for zero in self.zeros:
            boxes = boxes[~boxes.within(zero.domain)]
        return boxes

    def beside_family(self, boxes: Boxes) -> Array:
        """Return whether boxes are small enough beside a family of zeros, shape (m,).

        There the Hessian is nearly singular, and halves of the boxes would be so too.
        """
        radius = boxes.radius.max(axis=1, initial=0.0)
        found: Array = (radius < FAMILY_RADIUS) & self.family
        hessian = self.form.approximate(boxes.centre[found], 2)[2]
        found[found] = singular(hessian, 2 * radius[found])
        return found

    def examine(self, boxes: Boxes) -> tuple[Boxes, Array]:
        """Return the boxes that may hold an unknown zero, and the axis along which to cut each."""
        boxes = self.outside_domains(boxes)
        enclosed = enclosure(self.form, boxes)
        left = ~enclosed.monotonic
        boxes, enclosed = boxes[left], enclosed[left]
        bounds = enclosed.preconditioned(inverses(enclosed.hessian))
        left = ~bounds.excludes_zero
        if enclosed.kinks is not None:
            left &= ~enclosed.kinks.excludes_zero
        if self.tests is not None:
            left[left] = ~self.tests.excludes_zero(boxes[left], enclosed[left])
        near = left & np.all(np.abs(bounds.step) <= 2 * bounds.radius, axis=1)
        near &= not self.family
        self.add_zeros_at(_converged_points(self.form, boxes.centre[near][:MAX_STARTS]))
        if isinstance(enclosed, KinkedEnclosure):
            self._add_zeros_at_kinks(boxes[left & enclosed.jumps])
        if enclosed.kinks is not None:
            self._add_zeros_on_surfaces(boxes[left & enclosed.kinks.anywhere])
        for zero in self.zeros:
            left &= ~boxes.within(zero.domain)
        return boxes[left], boxes.radius[left].argmax(axis=1)

    def _add_zeros_at_kinks(self, boxes: Boxes) -> None:
        """Add the zeros at kinks near some boxes that are small enough."""
        for kink in kinks_of(self.form.guard):
            low, high = kink.ends
            reached = (boxes.low[:, 1] <= high) & (boxes.high[:, 1] >= low)
            near = reached & (boxes.radius.max(axis=1, initial=0.0) < NEAR_KINK)
            starts = boxes.centre[near][:MAX_STARTS]
            Theta, last = newton_at_kink(self.form, kink, starts)
            self.add_zeros_at(Theta[last < CONVERGED_STEP])

    def _add_zeros_on_surfaces(self, boxes: Boxes) -> None:
        """Add the zeros where elements of users jump, near some boxes that are small enough."""
        near = boxes.radius.max(axis=1, initial=0.0) < NEAR_KINK
        starts = boxes.centre[near][:MAX_STARTS]
        for surface in surfaces(self.form) if len(starts) else ():
            Theta, last = surface.newton(starts)
            self.add_zeros_at(Theta[last < CONVERGED_STEP])


@np.errstate(all="ignore")  # comparisons with NaN are false
def prove(
    form: TrigonometricForm,
    known: Iterable[Array] = (),
    box_limit: int = BOX_LIMIT,
    end: Array = RANGE_END,
    tests: Tests | None = None,
) -> Zeros:
    """Enclose every zero of ∇U in the box -end <= Θ <= end.

    Args:
        form: U.
        known: Points that may be zeros, each of shape (3,), rad. Each point is tested. They only
            save time: the same zeros are found without them.
        box_limit: The number of boxes at which the search stops.
        end: The largest |Θ|, shape (3,), rad, at most `form.reach`; by default that of eq. 5.
        tests: Further tests, or None.
    """
    search = _Search(form, tests)
    search.add_zeros_at(known)
    pending, undecided, examined = whole_range(end), [], 0
    while len(pending) and examined < box_limit:
        # The last boxes are the smallest. Taking them first finds zeros early and keeps the list
        # short.
        batch, pending = pending[-BATCH:], pending[:-BATCH]
        examined += len(batch)
        left, axis = search.examine(batch)
        if tests is not None and tests.hopeless(left, search.zeros):
            undecided.append(left)
            break
        small = left.radius.max(axis=1, initial=0.0) < MIN_RADIUS
        small |= search.beside_family(left)
        undecided.append(left[small])
        pending = joined([pending, left[~small].halves(axis[~small])])
    remaining = search.outside_domains(joined([no_boxes(), pending, *undecided]))
    return _classified(search, remaining, examined, whole_range(end), stopped=bool(len(pending)))


def _classified(
    search: _Search, undecided: Boxes, examined: int, whole: Boxes, *, stopped: bool
) -> Zeros:
    inside = [zero for zero in search.zeros if zero.enclosure.within(whole)[0]]
    outside = [zero for zero in search.zeros if not zero.enclosure.intersects(whole)[0]]
    straddling = [zero.enclosure for zero in search.zeros if zero not in [*inside, *outside]]
    covered = max(0.0, 1.0 - float(np.prod(undecided.radius / whole.radius, axis=1).sum()))
    undecided = joined([undecided, *straddling, *search.ambiguous])
    outcome = SearchOutcome.UNDECIDED if len(undecided) else SearchOutcome.PROVED
    if search.family or stopped:
        outcome = SearchOutcome.FAMILY if search.family else SearchOutcome.BOX_LIMIT
    return Zeros(tuple(inside), tuple(outside), undecided, examined, outcome, covered)


def _converged_points(form: TrigonometricForm, starts: Array) -> Array:
    Theta, last = newton(form, starts, SHORT_NEWTON_STEPS)
    return Theta[last < CONVERGED_STEP]
