"""Proved bounds of V over boxes, and the least value of V in each of some boxes, such as faces.

With S the mean slopes, V(m + δ) = V(m) + g'δ + ½ δ'S̄δ. For u = δ/r in [-1, 1]^n this is a
quadratic function a'u + ½ u'Au and what is not known of g and S̄. A numerical A = QDQ' + R with
any Q and D splits it: QD⁺Q' is convex, so a tangent plane is a lower bound, -QD⁻Q' is at least
-Σ d⁻(Σ|q|)², and R is bounded with all round-off. Nothing rests on the accuracy of Q and D.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Boxes, joined
from rbstab.proof.enclosures.bounds import UP, BoundedEnergy, Bounds, times
from rbstab.proof.enclosures.intervals import TINY, Intervals
from rbstab.proof.enclosures.tied import bounds_of
from rbstab.proof.exact.atoms import STEP
from rbstab.proof.exact.expr import expr
from rbstab.proof.exact.rewriting import substituted
from rbstab.proof.model import Energy

BATCH = 1024
"""Boxes that are bounded at once."""

TOLERANCE = 1e-9
"""The gap between lower bound and attained value, relative to the energies seen."""

ROUND_OFF = 64 * 2.0**-53
"""Covers sums and products of some thirty terms, relative to the sum of their magnitudes."""

LOOSE = 1e-6
"""The same in the second half of the boxes, such as where V is least along a curve."""

MOST_STEPS = 3
"""So many forces that jump give eight energies."""

SWEEPS = 6
"""Of the coordinates, towards the point at which the tangent plane touches."""


class Quadratic(NamedTuple):
    """Bounds on a'u + ½u'Au for u in [-1, 1]^n, and a point near the lowest, shape (n, boxes)."""

    low: Array
    high: Array
    u: Array


def quadratic_range(a: Array, A: Array) -> Quadratic:
    """Bound a'u + ½u'Au for all u in [-1, 1]^n; a has shape (n, boxes), A (n, n, boxes)."""
    stacked = np.moveaxis(A, 2, 0)
    D, vectors = np.linalg.eigh(0.5 * (stacked + np.swapaxes(stacked, 1, 2)))
    D, Q = D.T, np.moveaxis(vectors, 0, 2)
    size = np.einsum("ikm,km,jkm->ijm", np.abs(Q), np.abs(D), np.abs(Q))
    rest = np.abs(0.5 * (A + np.swapaxes(A, 0, 1)) - _composed(Q, D)).sum(axis=(0, 1))
    slack = ROUND_OFF * (np.abs(a).sum(axis=0) + (size + np.abs(A)).sum(axis=(0, 1))) + TINY
    unknown = 0.5 * rest * UP + slack
    spans = np.abs(Q).sum(axis=0) ** 2 * UP

    def least(a: Array, D: Array) -> tuple[Array, Array]:
        value, u = _convex_least(a, Q, np.maximum(D, 0.0))
        low = value - (0.5 * (np.maximum(-D, 0.0) * spans).sum(axis=0) + unknown) * UP
        return low - ROUND_OFF * np.abs(low), u

    (low, u), (high, _) = least(a, D), least(-a, -D)
    return Quadratic(low, -high, u)


def _composed(Q: Array, D: Array) -> Array:
    return np.asarray(np.einsum("ikm,km,jkm->ijm", Q, D, Q))


def _convex_least(a: Array, Q: Array, D: Array) -> tuple[Array, Array]:
    """Bound a'u + ½u'QDQ'u, D >= 0, from below by its tangent plane at a point near the lowest."""
    P = _composed(Q, D)
    along = np.einsum("jim,jm->im", Q, a) / np.where(D > 0, D, np.inf)
    u = np.clip(-times(Q, along), -1.0, 1.0)
    for _ in range(SWEEPS):
        for i in range(len(a)):
            pull = -(a[i] + np.einsum("jm,jm->m", P[i], u) - P[i, i] * u[i])
            bent = np.clip(pull / np.where(P[i, i] > 0, P[i, i], 1.0), -1.0, 1.0)
            u[i] = np.where(P[i, i] > 0, bent, np.sign(pull))
    slope = a + times(P, u)
    value = np.einsum("im,im->m", 0.5 * (a + slope), u)
    return value - (np.abs(slope) + slope * u).sum(axis=0), u


def range_of(b: Bounds) -> Intervals:
    """Return bounds on V over boxes: from its terms, its slopes, and Taylor's theorem."""
    return _taylor(b)[0]


def _taylor(b: Bounds) -> tuple[Intervals, Array]:
    """Return bounds on V over boxes, and the points in them where V is lowest by the middles."""
    r, g, (S, s) = b.radius, b.gradient, b.slope
    with np.errstate(all="ignore"):
        S, s = S * (r[:, None] * r), s * (r[:, None] * r)
        a = g.mid * r
        spread = (0.5 * s.sum(axis=(0, 1)) + (g.rad * r).sum(axis=0)) * UP
        # The products above are rounded too.
        spread = spread + ROUND_OFF * (np.abs(a).sum(axis=0) + np.abs(S).sum(axis=(0, 1)))
        good = np.isfinite(spread)
        quadratic = quadratic_range(np.where(good, a, 0.0), np.where(good, S, 0.0))
        first = (b.slopes.mag * r).sum(axis=0) * UP
        fall = np.fmin(first, np.where(good, spread - quadratic.low, np.inf))
        rise = np.fmin(first, np.where(good, spread + quadratic.high, np.inf))
        low, high = b.value.lo - fall, b.value.hi + rise
        low = low - ROUND_OFF * (np.abs(b.value.lo) + np.abs(fall))
        high = high + ROUND_OFF * (np.abs(b.value.hi) + np.abs(rise))
    low, high = np.fmax(b.value_over.lo, low), np.fmin(b.value_over.hi, high)
    low, high = np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)
    return Intervals(low, high), b.centre + np.where(good, quadratic.u, 0.0) * r


class Ranges:
    """Bounds on V over boxes, also sharp ones where a force jumps.

    At each point the steps of such forces are 0 or 1, so V is there one of the smooth energies with
    these numbers in place of the steps. Its bounds over a box are the hull of theirs.

    Args:
        V: Bounds on V.
        sides: Bounds on the energies with each choice of 0 and 1; none if no force jumps.
    """

    def __init__(self, V: BoundedEnergy, sides: Sequence[BoundedEnergy] = ()) -> None:
        self.V, self.sides, self.n = V, tuple(sides), V.n

    @classmethod
    def of(cls, energy: Energy, V: BoundedEnergy | None = None) -> "Ranges":
        """Return bounds on an energy, with its sides if few forces jump, at surfaces of Θ."""
        V = bounds_of(energy) if V is None else V
        steps = [a for a in energy.U.all_atoms if a.kind == STEP and a.extra == 1]
        if len(steps) > MOST_STEPS or any(set(a.inner.variables) & set(energy.free) for a in steps):
            return cls(V)
        sides = []
        for choice in product((0, 1), repeat=len(steps)) if steps else ():
            fixed = {step: expr(on) for step, on in zip(steps, choice, strict=True)}
            sides.append(bounds_of(replace(energy, U=substituted(energy.U, fixed))))
        return cls(V, sides)

    def over(self, boxes: Boxes) -> tuple[Bounds, Intervals, Array]:
        """Return the bounds over boxes, on V with what they imply, and points where V is low."""
        b = self.V.over(boxes.lo, boxes.hi)
        range_, near = _taylor(b)
        rough = ~np.all(np.isfinite(b.slope.rad), axis=(0, 1)) & bool(self.sides)
        if rough.any():
            some = boxes[rough]
            ranges = [range_of(side.over(some.lo, some.hi)) for side in self.sides]
            low = np.min([side_range.lo for side_range in ranges], axis=0)
            high = np.max([side_range.hi for side_range in ranges], axis=0)
            range_.lo[rough] = np.fmax(range_.lo[rough], low)
            range_.hi[rough] = np.fmin(range_.hi[rough], high)
        return b, range_, near

    def values(self, boxes: Boxes) -> Intervals:
        """Return bounds on V over boxes, J, in batches."""
        batches = (boxes[slice(k, k + BATCH)] for k in range(0, boxes.count, BATCH))
        parts = [self.over(some)[1].ends for some in batches]
        return Intervals.of(np.concatenate([np.zeros((2, 0)), *parts], 1))


class LeastValues(NamedTuple):
    """The least V in each of some boxes.

    Attributes:
        value: An upper bound of V at a point, J, shape (boxes,).
        bound: A proved lower bound, J; far below `value` if the limit of boxes was reached.
        at: The points, shape (n, boxes).
    """

    value: Array
    bound: Array
    at: Array


def least_values(
    ranges: Ranges,
    boxes: Boxes,
    limit: int = 8_000,
    cap: float = np.inf,
    *,
    of_all: bool = False,
) -> LeastValues:
    """Return the least V in each of some boxes, by branch and bound.

    Args:
        ranges: V.
        boxes: The boxes; they may be flat.
        limit: The number of boxes that are examined.
        cap: Boxes in which V is larger than this need not be searched, J.
        of_all: Whether only the least V in all of them is wanted. Then the bounds of the others may
            be as low as this one.
    """
    at = 0.5 * boxes.lo + 0.5 * boxes.hi
    near, n = at.copy(), boxes.count
    best, settled, scale, noise = np.full(n, np.inf), np.full(n, np.inf), np.zeros(n), np.zeros(n)
    parts, owners, examined = boxes, np.arange(n), 0
    while parts.count and examined < limit:
        some, owner = parts[slice(BATCH)], owners[:BATCH]
        parts, owners = parts[slice(BATCH, None)], owners[BATCH:]
        examined += some.count
        b, over, lowest = ranges.over(some)
        value = np.where(np.isfinite(b.value.hi), b.value.hi, np.inf)
        first = _first_of_each(owner, value)
        first = first[value[first] <= best[owner[first]]]
        k, gap = owner[first], (b.value.hi - b.value.lo)[first]
        best[k], at[:, k], near[:, k] = value[first], b.centre[:, first], lowest[:, first]
        noise[k] = np.where(np.isfinite(gap), gap, noise[k])
        np.fmax.at(scale, owner, np.where(np.isfinite(value), value, -np.inf) - best[owner])
        tolerance = TOLERANCE if examined < limit / 2 else LOOSE
        # Round-off of V itself is the least gap that any box can have.
        aim = best - tolerance * scale - 4 * noise - 1e-14 * np.abs(best)
        aim = np.minimum(aim.min() if of_all else aim[owner], cap)
        done = over.lo >= aim
        np.fmin.at(settled, owner[done], over.lo[done])
        parts = joined([some[~done].halved(), parts], ranges.n)
        owners = np.concatenate([owner[~done], owner[~done], owners])
    if parts.count:
        np.fmin.at(settled, owners, ranges.values(parts).lo)
    # Of the smallest box about the lowest point, the quadratic model knows this point better.
    near = np.clip(near, boxes.lo, boxes.hi)
    value = ranges.values(Boxes(near, near)).hi
    at, best = np.where(value < best, near, at), np.minimum(value, best)
    return LeastValues(best, np.minimum(settled, best), at)


def _first_of_each(owner: Array, low: Array) -> Array:
    """Return for each owner the place of its lowest number."""
    order = np.lexsort((low, owner))
    first = np.ones(len(order), dtype=bool)
    first[1:] = owner[order][1:] != owner[order][:-1]
    return order[first]
