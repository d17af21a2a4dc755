"""All zeros of ∇V in a box, by branch and bound, and a proof that each of them is one.

A box is done if a component of ∇V has one sign on it, if Krawczyk's operator maps it out of itself,
or if it lies where a proved zero is the only one. All others are cut down to the image of this
operator, and halved.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.bounds import (
    UP,
    BoundedEnergy,
    Bounds,
    Matrices,
    inverses,
    preconditioned,
)
from rbstab.proof.enclosures.index import proved_index

RADII = np.geomspace(1e-15, 2.0, 160)
"""The radii of the boxes about a point, of which one is proved to have a single zero."""

BATCH = 1024
"""Boxes that are bounded at once; a quarter of it with free variables, whose series are longer."""

SMALLEST = 2e-7
"""The size of a box, relative to the scale of each variable, that is not halved any more."""

LONGEST_PAUSE = 15
"""After so many batches of boxes at most, Newton's method is tried again."""

ZERO_STEP = 1e-9
"""A Newton step that is shorter has arrived."""

TRY_STEPS = 12
"""Newton steps from the centre of a box; a box near a zero needs fewer."""

MOST_TINY = 64
"""Boxes too small to be halved from whose centres zeros are looked for at the end."""

NEAR_FAILED = 1e-8
"""Points that are nearer to one that could not be isolated are not tried."""

FAMILY_TRIES = 12
"""So many different points that cannot be isolated are taken for a family of zeros."""

FAMILY_APART = 1e-3

SINGULAR = 1e-6
"""A smaller eigenvalue of a Hessian, relative to the largest, is taken for zero."""

AT_BORDER = 1e-6
"""At the ends of the range the angles themselves may be singular."""


class Box(NamedTuple):
    """A box from lo to hi, both of shape (n,)."""

    lo: Array
    hi: Array

    def contains(self, x: Array) -> bool:
        """Return whether a point lies in it."""
        return bool(np.all((x >= self.lo) & (x <= self.hi)))


@dataclass(frozen=True, eq=False)
class Boxes:
    """Boxes from lo to hi, both of shape (n, boxes)."""

    lo: Array
    hi: Array

    def __iter__(self) -> Iterator[Array]:
        """Yield lo and hi."""
        return iter((self.lo, self.hi))

    @property
    def count(self) -> int:
        """Their number."""
        return int(self.lo.shape[1])

    def __getitem__(self, place: Array | slice) -> "Boxes":
        """Return some of them."""
        return Boxes(self.lo[:, place], self.hi[:, place])

    def within(self, outer: Box) -> Array:
        """Return which of them lie in a box."""
        return np.asarray(
            np.all((self.lo >= outer.lo[:, None]) & (self.hi <= outer.hi[:, None]), axis=0)
        )

    def touch(self, other: Box) -> Array:
        """Return which of them have a point in common with a box."""
        return np.asarray(
            np.all((self.lo <= other.hi[:, None]) & (self.hi >= other.lo[:, None]), axis=0)
        )

    def halved(self, axis: Array) -> "Boxes":
        """Return both halves of each, along its axis."""
        columns = np.arange(self.count)
        middle = 0.5 * self.lo[axis, columns] + 0.5 * self.hi[axis, columns]
        below, above = self.hi.copy(), self.lo.copy()
        below[axis, columns] = above[axis, columns] = middle
        return joined([Boxes(self.lo, below), Boxes(above, self.hi)], len(self.lo))


def joined(parts: Sequence[Boxes], n: int) -> Boxes:
    """Return the boxes of all parts, of n axes."""
    none = np.zeros((n, 0))
    return Boxes(
        np.concatenate([none, *(part.lo for part in parts)], 1),
        np.concatenate([none, *(part.hi for part in parts)], 1),
    )


def hulls(boxes: Boxes) -> Boxes:
    """Merge boxes that touch into their hulls, which cover all of them; they have three axes."""
    for axis in range(3):
        boxes = _rows_joined(boxes, axis)
    found = list[Boxes]()
    while boxes.count:
        hull, members = boxes[slice(1)], boxes.touch(Box(boxes.lo[:, 0], boxes.hi[:, 0]))
        while members.any():
            taken = joined([hull, boxes[members]], 3)
            lo, hi = taken.lo.min(axis=1), taken.hi.max(axis=1)
            hull, boxes = one_box(Box(lo, hi)), boxes[~members]
            members = boxes.touch(Box(lo, hi))
        found.append(hull)
    return joined(found, 3)


def _rows_joined(boxes: Boxes, axis: int) -> Boxes:
    """Return one box for each row of boxes along an axis that touch and are equal in the others.

    A search leaves thousands of boxes that fill a part of the range; few remain.
    """
    others = [k for k in range(3) if k != axis]
    across = np.concatenate([boxes.lo[others], boxes.hi[others]])
    order = np.lexsort([boxes.lo[axis], *across])
    lo, hi, across = boxes.lo[:, order], boxes.hi[:, order], across[:, order]
    goes_on = np.all(across[:, 1:] == across[:, :-1], axis=0) & (lo[axis, 1:] <= hi[axis, :-1])
    starts = np.flatnonzero(np.concatenate([[True], ~goes_on])[: boxes.count])
    if not len(starts):
        return boxes
    return Boxes(lo[:, starts], np.maximum.reduceat(hi, starts, axis=1))


def one_box(box: Box) -> Boxes:
    """Return one box as boxes."""
    return Boxes(box.lo[:, None].astype(float), box.hi[:, None].astype(float))


@dataclass(frozen=True, eq=False)
class Zero:
    """A zero of ∇V.

    Args:
        point: A point near it, shape (n,).
        enclosure: A box that contains exactly this zero.
        domain: A wider box in which there is no other.
        index: The number of negative eigenvalues of ∇²V there; None if it is not proved.
        energy: V near it, J.
        normal: Across the surface at which a force that jumps holds the body; None elsewhere.
        ridge: Whether this force pushes away.
    """

    point: Array
    enclosure: Box
    domain: Box
    index: int | None
    energy: float
    normal: Array | None = None
    ridge: bool = False

    @property
    def held(self) -> bool:
        """Whether a force that jumps holds the body there."""
        return self.normal is not None


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
    """

    zeros: tuple[Zero, ...]
    undecided: Boxes
    examined: int
    family: bool = False
    share: float = 1.0
    singular: tuple[Array, ...] = ()

    @property
    def proved(self) -> bool:
        """Whether these are proved to be all zeros."""
        return self.undecided.count == 0


def newton(
    energy: BoundedEnergy,
    starts: Array,
    steps: int = 30,
    known: Callable[[Array], Array] | None = None,
) -> tuple[Array, Array]:
    """Follow Newton's method from points of shape (n, points); return the ends and last steps.

    It moves in all variables at once, from where U is least over z. It ends when each point is at
    a zero, or where `known` says so.
    """
    z = energy.minimiser(starts).z if energy.k else np.zeros((0, starts.shape[1]))
    x, last = np.concatenate([starts, z]), np.full(starts.shape[1], np.inf)
    with np.errstate(all="ignore"):
        for _ in range(steps):
            _, g, H = energy.at_all(x[: energy.n], x[energy.n :])
            step, error = _newton_steps(H, g)
            last = np.maximum(np.abs(step).max(axis=0), error)
            step = step * np.minimum(1.0, 0.5 / np.maximum(last, 1e-300))
            x = x - np.where(np.isfinite(step), step, 0.0)
            left = last > 1e-13
            if not np.any(left if known is None else left & ~known(x[: energy.n])):
                break
    return x[: energy.n], last


def _newton_steps(H: Array, g: Array) -> tuple[Array, Array]:
    """Return H⁻¹g for each point, and 0; for a singular H the shortest step, and what it leaves."""
    step, left = np.einsum("ijm,jm->im", inverses(H), g), np.zeros(g.shape[1])
    known = np.all(np.isfinite(H), axis=(0, 1)) & np.all(np.isfinite(g), axis=0)
    for k in np.flatnonzero(known & ~np.all(np.isfinite(step), axis=0)):  # as in a family
        step[:, k] = np.linalg.pinv(H[:, :, k], hermitian=True) @ g[:, k]
        size = max(np.abs(H[:, :, k]).max(), 1e-300)
        left[k] = np.abs(H[:, :, k] @ step[:, k] - g[:, k]).max() / size
    return step, left


def isolated(energy: BoundedEnergy, point: Array) -> Zero | None:
    """Prove that there is exactly one zero near a point; None if no box about it shows this."""
    lo = np.nextafter(point[:, None] - RADII, -np.inf)
    hi = np.nextafter(point[:, None] + RADII, np.inf)
    b = energy.over(lo, hi)
    step, error, mean, hessian = preconditioned(b)
    with np.errstate(all="ignore"):
        unique = hessian.sum(axis=1).max(axis=0) * UP < 1
        image = np.abs(step) + error + np.einsum("ijm,jm->im", mean, b.radius)
        inner = np.minimum(hi - b.centre, b.centre - lo)
        exists = np.all(image * UP < np.nextafter(inner, -np.inf), axis=0)
    both = np.flatnonzero(unique & exists)
    if not len(both):
        return None
    e, d = int(both[0]), int(np.flatnonzero(unique)[-1])
    return Zero(
        point,
        Box(lo[:, e], hi[:, e]),
        Box(lo[:, d], hi[:, d]),
        index_of(b.hessian, e),
        float(b.value.mid[e]),
    )


def index_of(hessian: Matrices, k: int) -> int | None:
    """Return the proved number of negative eigenvalues of the k-th matrix, or None."""
    return proved_index(hessian.mid[:, :, k], hessian.rad[:, :, k] * UP)


Test = Callable[[Boxes, Bounds], Array]
"""One more reason why boxes contain no zero: returns which."""


class Search:
    """The search for all zeros of ∇V in a box.

    Args:
        energy: V.
        box: The box.
        scale: The size of each variable; the widest relative to it is halved.
        known: Zeros that are proved already.
        also: One more reason why boxes contain no zero.
        across: Whether a zero that may lie on the border counts too, and is not left undecided.
    """

    def __init__(  # noqa: PLR0913 (what a search may be given besides V)
        self,
        energy: BoundedEnergy,
        box: Box,
        *,
        scale: Array | None = None,
        known: Sequence[Zero] = (),
        also: Test | None = None,
        across: bool = False,
    ) -> None:
        self.energy, self.box, self.also, self.across = energy, box, also, across
        self.scale = np.ones(len(box.lo)) if scale is None else scale
        self.zeros: list[Zero] = list(known)
        self.failed: list[Array] = []
        self.ambiguous: list[Box] = []
        self.left = one_box(box)
        self.examined = 0
        self.pause, self.waiting = 0, 0

    def run(self, limit: int, starts: Array | None = None, begin: Boxes | None = None) -> Zeros:
        """Search until all boxes are done, or a number of boxes is examined.

        Args:
            limit: The number of boxes.
            starts: Points from which Newton's method is tried first, shape (n, points).
            begin: The parts of the box that are not done yet; by default all of it.
        """
        n, batch = len(self.box.lo), BATCH // 4 if self.energy.k else BATCH
        if starts is not None and starts.shape[1]:
            self._try(starts)
        pending, left = [one_box(self.box) if begin is None else begin], list[Boxes]()
        while pending and self.examined < limit and not self.family:
            boxes = pending.pop()
            if boxes.count < batch and pending:
                boxes = joined([boxes, pending.pop()], n)
            if boxes.count > batch:
                pending.append(boxes[slice(batch, None)])
                boxes = boxes[slice(batch)]
            self.examined += boxes.count
            halves, tiny = self._step(boxes)
            left += [tiny] if tiny.count else []
            pending += [halves] if halves.count else []
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
        undecided = self.left = undecided[self._open(undecided)]
        volume = np.prod(
            (undecided.hi - undecided.lo) / (self.box.hi - self.box.lo)[:, None], axis=0
        )
        return self._result(undecided, 1.0 - float(volume.sum()))

    @property
    def family(self) -> bool:
        """Whether zeros seem to form a family."""
        return len(self.failed) >= FAMILY_TRIES

    def _result(self, undecided: Boxes, share: float) -> Zeros:
        """Return the zeros inside; one that may lie on the border is undecided."""
        inside, across = [], [one_box(box) for box in self.ambiguous]
        for zero in self.zeros:
            low, high = zero.enclosure
            touches = np.all(high >= self.box.lo) and np.all(low <= self.box.hi)
            if (np.all(low > self.box.lo) and np.all(high < self.box.hi)) or (
                touches and self.across
            ):
                inside.append(zero)
            elif touches:
                across.append(one_box(zero.enclosure))
        undecided = joined([undecided, *across], len(self.box.lo))
        order = tuple(sorted(inside, key=lambda zero: zero.energy))
        singular = tuple(self.failed)
        return Zeros(order, undecided, self.examined, self.family, share, singular)

    def _open(self, boxes: Boxes) -> Array:
        """Return which boxes do not lie in the domain of a proved zero."""
        found = np.ones(boxes.count, dtype=bool)
        for zero in self.zeros:
            found &= ~boxes.within(zero.domain)
        return found

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
            if any(np.abs(x - other).max() < NEAR_FAILED for other in self.failed):
                continue
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
        around = one_box(zero.enclosure)
        if any(around.within(other.domain)[0] for other in self.zeros):
            return
        if any(around.touch(other.domain)[0] for other in self.zeros):
            self.ambiguous.append(zero.enclosure)
        else:
            self.zeros.append(zero)

    def _is_bounded(self, low: Array, high: Array) -> bool:
        """Return whether the known lower bounds of atoms hold between two points.

        They do in the box. Beyond it the bounds are those of another function, which may have a
        zero in whose domain that of V would be overlooked.
        """
        known = frozenset[int]().union(*(a.variables for a in self.energy.least))
        axes = [i for i, v in enumerate(self.energy.variables) if v in known]
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
        left &= self._open(cut)
        return self._split(cut[left], mean[:, :, left], b.radius[:, left])

    def _split(self, boxes: Boxes, mean: Array, radius: Array) -> tuple[Boxes, Boxes]:
        """Halve boxes along the axis that spoils Krawczyk's operator most, if it is not narrow."""
        width = (boxes.hi - boxes.lo) / self.scale[:, None]
        tiny = width.max(axis=0, initial=0.0) < SMALLEST
        small, boxes, width = boxes[tiny], boxes[~tiny], width[:, ~tiny]
        if not boxes.count:
            return boxes, small
        with np.errstate(all="ignore"):
            smear = np.einsum("ijm,jm->jm", np.abs(mean[:, :, ~tiny]), radius[:, ~tiny])
        widest = width.argmax(axis=0)
        axis = np.where(np.all(np.isfinite(smear), axis=0), smear.argmax(axis=0), widest)
        columns = np.arange(boxes.count)
        axis = np.where(width[axis, columns] < 0.1 * width.max(axis=0), widest, axis)
        return boxes.halved(axis), small
