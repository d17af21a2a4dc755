"""All zeros of ∇V in a box, by branch and bound, and a proof that each of them is one.

A box is done if a component of ∇V has one sign on it, if Krawczyk's operator maps it out of itself,
or if it lies where a proved zero is the only one. All others are cut down to the image of this
operator, and halved.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box, Boxes, as_boxes, joined
from rbstab.proof.enclosures.bounds import UP, BoundedEnergy, Bounds, preconditioned
from rbstab.proof.zeros import Zero, isolated, newton, ordered

BATCH = 1024
"""Boxes that are bounded at once."""

SMALLEST = 2e-7
"""The size of a box that is not halved any more."""

LONGEST_PAUSE = 15
"""After so many batches of boxes at most, Newton's method is tried again."""

ZERO_STEP = 1e-9
"""A Newton step that is shorter has arrived."""

TRY_STEPS = 12
"""Newton steps from the centre of a box; a box near a zero needs fewer."""

MOST_TINY = 64
"""Boxes too small to be halved from whose centres zeros are looked for at the end."""

NEAR = 1e-8
"""Points that are nearer to one that was tried are not tried again."""

FAMILY_TRIES = 12
"""So many different points that cannot be isolated are taken for a family of zeros."""

TELLING, TOO_LITTLE = 20_000, 0.5
"""A search with variables z takes long for each box. After so many boxes, and whenever their number
has doubled, it ends early if at its rate so far it would decide less than this share of the box."""

FAMILY_APART = 1e-3

SINGULAR = 1e-6
"""A smaller eigenvalue of a Hessian, relative to the largest, is taken for zero."""

AT_BORDER = 1e-6
"""At the ends of the range the angles themselves may be singular."""


@dataclass(frozen=True, eq=False)
class Zeros:
    """The zeros of ∇V in a box, in the order of V.

    Args:
        zeros: The zeros.
        undecided: Boxes that may contain others.
        examined: The number of boxes that were examined.
        family: Whether the search ended because zeros seem to form a family.
        share: The share of the volume of the box that is decided.
        singular: Points that seem to be zeros with a singular Hessian, each of shape (n,).
        stopped: Whether the search ended at its limit of boxes, or as this would not be enough.
    """

    zeros: tuple[Zero, ...]
    undecided: Boxes
    examined: int
    family: bool = False
    share: float = 1.0
    singular: tuple[Array, ...] = ()
    stopped: bool = False

    @property
    def proved(self) -> bool:
        """Whether these are proved to be all zeros."""
        return self.undecided.count == 0


Test = Callable[[Boxes, Bounds], Array]
"""One more reason why boxes contain no zero: returns which."""


class Search:
    """The search for all zeros of ∇V in a box.

    Args:
        energy: V.
        box: The box.
        also: One more reason why boxes contain no zero.
        across: Whether a zero that may lie on the border counts too, and is not left undecided.
    """

    def __init__(
        self,
        energy: BoundedEnergy,
        box: Box,
        *,
        also: Test | None = None,
        across: bool = False,
    ) -> None:
        self.energy, self.box, self.also, self.across = energy, box, also, across
        self.zeros: list[Zero] = []
        self.tried: list[Array] = []
        self.failed: list[Array] = []
        self.ambiguous: list[Box] = []
        self.left = as_boxes(box)
        self.examined, self.stopped = 0, False
        self.pause, self.waiting = 0, 0

    def run(self, limit: int) -> Zeros:
        """Search until all boxes are done, or a number of boxes is examined."""
        n, look = len(self.box.lo), float(TELLING if self.energy.k else np.inf)
        self.stopped = limit <= 0
        pending, left = [as_boxes(self.box)], list[Boxes]()
        while pending and not self.stopped and not self.family:
            boxes = pending.pop()
            if boxes.count < BATCH and pending:
                boxes = joined([boxes, pending.pop()], n)
            if boxes.count > BATCH:
                pending.append(boxes[slice(BATCH, None)])
                boxes = boxes[slice(BATCH)]
            self.examined += boxes.count
            halves, tiny = self._step(boxes)
            left += [tiny] if tiny.count else []
            pending += [halves] if halves.count else []
            self.stopped = self.examined >= limit
            if self.examined >= look:
                look, share = 2.0 * self.examined, 1.0 - sum(map(self._share, pending))
                self.stopped |= share * limit < TOO_LITTLE * self.examined
        tiny = joined(left, n)
        if tiny.count and not self.family:
            # Krawczyk's operator may have cut a box down to a zero that nobody looked for.
            self._try((0.5 * tiny.lo + 0.5 * tiny.hi)[:, :MOST_TINY])
        return self._ended(joined([tiny, *pending], n))

    def with_zeros_near(self, points: Array) -> Zeros:
        """Return what the last search found, with zeros that are reached from further points."""
        self._try(points)
        return self._ended(self.left)

    def _ended(self, undecided: Boxes) -> Zeros:
        """Return the zeros inside; one that may lie on the border is undecided."""
        undecided = self.left = undecided[self._open(undecided)]
        inside, across = [], [as_boxes(box) for box in self.ambiguous]
        for zero in self.zeros:
            low, high = zero.enclosure
            touches = np.all(high >= self.box.lo) and np.all(low <= self.box.hi)
            if (np.all(low > self.box.lo) and np.all(high < self.box.hi)) or (
                touches and self.across
            ):
                inside.append(zero)
            elif touches:
                across.append(as_boxes(zero.enclosure))
        return Zeros(
            ordered(inside),
            joined([undecided, *across], len(self.box.lo)),
            self.examined,
            self.family,
            1.0 - self._share(undecided),
            tuple(self.failed),
            self.stopped,
        )

    def _share(self, boxes: Boxes) -> float:
        """Return the share of the box that some boxes take."""
        sizes = (boxes.hi - boxes.lo) / (self.box.hi - self.box.lo)[:, None]
        return float(np.prod(sizes, axis=0).sum())

    @property
    def family(self) -> bool:
        """Whether zeros seem to form a family."""
        return len(self.failed) >= FAMILY_TRIES

    def _open(self, boxes: Boxes) -> Array:
        """Return which boxes do not lie in the domain of a proved zero."""
        outside = np.ones(boxes.count, dtype=bool)
        for zero in self.zeros:
            outside &= ~boxes.within(zero.domain)
        return outside

    def _try_near(self, points: Array) -> None:
        """Try points near boxes that may have zeros; after tries in vain ever more seldom."""
        if self.waiting > 0:
            self.waiting -= 1
            return
        before = len(self.zeros) + len(self.failed)
        self._try(points)
        in_vain = len(self.zeros) + len(self.failed) == before
        self.pause = min(2 * self.pause + 1, LONGEST_PAUSE) if in_vain else 0
        self.waiting = self.pause

    def _try(self, points: Array) -> None:
        """Follow Newton's method from points, and prove the zeros in which it ends."""
        ends, last = newton(self.energy, points, TRY_STEPS, lambda x: ~self._open(Boxes(x, x)))
        for x, size in zip(ends.T, last, strict=True):
            if not (size < ZERO_STEP and self._is_bounded(x, x)):
                continue
            if any(zero.domain.contains(x) for zero in self.zeros):
                continue
            if any(np.abs(x - other).max() < NEAR for other in self.tried):
                continue
            self.tried.append(x)
            zero = isolated(self.energy, x)
            if zero is not None:
                if self._is_bounded(*zero.enclosure):
                    self._add(zero)
            elif self._may_be_of_family(x):
                self.failed.append(x)

    def _may_be_of_family(self, x: Array) -> bool:
        """Return whether a point is a singular zero apart from others, and inside of the box."""
        inside = np.all((x > self.box.lo + AT_BORDER) & (x < self.box.hi - AT_BORDER))
        if not inside or any(np.abs(x - other).max() <= FAMILY_APART for other in self.failed):
            return False
        values = np.abs(self.energy.curvatures(x))
        return bool(values.min() <= SINGULAR * values.max())

    def _add(self, zero: Zero) -> None:
        """Add a zero, unless it is a known one; where that is not known, it is undecided."""
        around = as_boxes(zero.enclosure)
        if any(around.within(other.domain)[0] for other in self.zeros):
            return
        if any(around.touch(other.domain)[0] for other in self.zeros):
            self.ambiguous.append(zero.enclosure)
        else:
            self.zeros.append(zero)

    def _is_bounded(self, low: Array, high: Array) -> bool:
        """Return whether the known lower bounds of atoms hold between two points."""
        # They do in the box. Beyond it the bounds are those of another function, which may have a
        # zero in whose domain that of V would be overlooked.
        bounded = frozenset[int]().union(*(a.variables for a in self.energy.least))
        axes = [i for i, v in enumerate(self.energy.variables) if v in bounded]
        above = np.all(low[axes] > self.box.lo[axes])
        return bool(above and np.all(high[axes] < self.box.hi[axes]))

    def _step(self, boxes: Boxes) -> tuple[Boxes, Boxes]:
        """Return the halves of the boxes that are not done, and those too small to be halved."""
        boxes = boxes[self._open(boxes)]
        if not boxes.count:
            return boxes, boxes
        b = self.energy.over(boxes.lo, boxes.hi)
        with np.errstate(all="ignore"):
            g = b.slopes
            left = ~np.any((g.lo > 0) | (g.hi < 0), axis=0)
            if self.also is not None:
                left &= ~self.also(boxes, b)
            step, error, mean, _ = preconditioned(b)
            spread = error + np.einsum("ijm,jm->im", mean, b.radius) * UP
            left &= ~np.any(np.abs(step) > (b.radius + spread) * UP, axis=0)
            near = left & np.all(np.abs(step) <= 1.1 * b.radius, axis=0)
            near |= left & np.isnan(step).all(axis=0) & np.isfinite(b.slope.mid).all(axis=(0, 1))
            # Cut down to the image of Krawczyk's operator.
            low = np.nextafter(b.centre - step - spread * UP, -np.inf)
            high = np.nextafter(b.centre - step + spread * UP, np.inf)
            low, high = np.fmax(boxes.lo, low), np.fmin(boxes.hi, high)
            left &= ~np.any(low > high, axis=0)
            # One step of Newton's method further; not where it leads to a zero that is known.
            ahead = np.where(np.isfinite(step), b.centre - step, b.centre)
            near &= self._open(Boxes(ahead, ahead))
        if near.any():
            self._try_near(ahead[:, near][:, :8])
        cut = Boxes(np.where(left, low, boxes.lo), np.where(left, high, boxes.hi))
        cut = cut[left & self._open(cut)]
        tiny = (cut.hi - cut.lo).max(axis=0) < SMALLEST
        return cut[~tiny].halved(), cut[tiny]
