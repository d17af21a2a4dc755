"""Branches of rest states (Θ, p): curves ∇V(Θ, p) = 0, followed in doubles along their length.

A step leads along the tangent; Newton's method, on the plane across it, leads back to the curve. So
a curve is followed through *folds*, where it turns in p, and two rest states meet. Where an
eigenvalue of ∇²V changes its sign and the curve does not turn, another curve crosses it: at a
*pitchfork*, if V changes alike to both sides along the eigenvector, as of symmetric branches. p is
counted in shares of its interval.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.along.energy import RANGE, AlongEnergy, OverInterval
from rbstab.proof.pieces import Piece

STEP, SHORTEST, LONGEST = 0.02, 1e-5, 0.04
"""rad, and shares of the interval: the first step along a curve, and the limits of others."""

MOST_STEPS = 4_000

STRAIGHT = 0.95
"""The least cosine between the tangents of two points; a longer step may lead to another curve."""

NEWTON_STEPS, ARRIVED = 8, 1e-11

SAME = 1e-5
"""Points of (Θ, p) that are nearer are one."""

AT_BORDER = 1e-3
"""rad: a curve that ends nearer to the border of the range leaves it there."""

SIDEWAYS = 1e-3
"""rad: the difference along an eigenvector from which a third derivative is computed."""

ODD = 1e-3
"""rad: a third derivative of V over its largest second derivative that is not zero."""


ACROSS = np.eye(4)[3]
"""The normal of the plane of one p."""


class Turn(NamedTuple):
    """Where rest states appear, vanish, or exchange their stability.

    Attributes:
        kind: "fold", "pitchfork", or "crossing" of two branches without symmetry.
        value: p.
        orientation: Θ, shape (3,), rad.
    """

    kind: str
    value: float
    orientation: Array


@dataclass(frozen=True, eq=False)
class Branch:
    """A curve of rest states.

    Args:
        values: p, shape (m,).
        orientations: Θ, shape (m, 3), rad.
        index: The number of negative eigenvalues of ∇²V, shape (m,): 0 where they are stable. At a
            turn it is the larger one of both sides.
    """

    values: Array
    orientations: Array
    index: Array

    def at(self, value: float) -> Iterator[tuple[Array, int]]:
        """Yield Θ near each rest state of this curve at p, and its index; away from its turns."""
        below = self.values < value
        for k in np.flatnonzero(below[1:] != below[:-1]):
            share = (value - self.values[k]) / (self.values[k + 1] - self.values[k])
            a, b = self.orientations[k : k + 2]
            yield a + share * (b - a), self.index[k : k + 2].min()


class Branches:
    """The curves of rest states that are found, over the interval of p.

    Args:
        energy: V(Θ, p).
    """

    def __init__(self, energy: AlongEnergy) -> None:
        self.energy, self.low, self.high = energy, energy.low, energy.high
        self.width = self.high - self.low
        self.curves = list[Branch]()
        self.turns = dict[tuple[float, ...], Turn]()

    def search(self, value: float) -> None:
        """Look for rest states at a value of p, and follow the curves through new ones."""
        p = (value - self.low) / self.width
        for zero in Piece(OverInterval(self.energy, value, value), RANGE).zeros(0).zeros:
            x = np.append(zero.point, p)
            if not self._is_on_curve(x):
                back = self._way(x, -1.0)
                ahead = [] if back and back[-1] is x else self._way(x, 1.0)
                points = [*back[::-1], x, *ahead]
                # Near a turn a step may have led to a known curve: one point of it is kept.
                for end, inside in ((-1, -2), (0, 1)):
                    while len(points) > 1 and self._is_on_curve(points[inside]):
                        points.pop(end)
                self._add(points)

    def _is_on_curve(self, x: Array) -> bool:
        """Return whether a curve that is known leads through a point, to round-off."""
        for curve in self.curves:
            shares = (curve.values - self.low) / self.width
            y = np.column_stack([curve.orientations, shares])
            way = np.diff(y, axis=0)
            size = np.maximum((way * way).sum(1), SAME**4)
            share = np.clip(((x - y[:-1]) * way).sum(1) / size, 0.0, 1.0)
            feet = y[:-1] + share[:, None] * way
            for k in np.abs(feet - x).max(1).argsort()[:1]:
                on = self._on_plane(feet[k], way[k] / np.sqrt(size[k]))
                if on is not None and np.abs(on - x).max() < SAME:
                    return True
        return False

    def states(self, value: float) -> list[tuple[Array, int]]:
        """Return Θ near each rest state of all curves at p, and its index; away from turns."""
        return [state for curve in self.curves for state in curve.at(value)]

    def leave(self, low: float, high: float) -> bool:
        """Return whether a curve ends at the border of the range of Θ, for p in an interval."""
        ends = [(curve.values[k], curve.orientations[k]) for curve in self.curves for k in (0, -1)]
        border = RANGE.hi - AT_BORDER
        return any(low <= p <= high and np.any(np.abs(Theta) > border) for p, Theta in ends)

    def _slopes(self, x: Array) -> tuple[Array, Array]:
        """Return ∇V by Θ, shape (3,), and its derivatives by Θ and p, shape (3, 4)."""
        point = np.append(x[:3], (x[3] - 0.5) * self.width)
        _, g, H = self.energy.at(point[:, None])
        return g[:3, 0], H[:3, :, 0] * (1.0, 1.0, 1.0, self.width)

    def _on_plane(self, x: Array, normal: Array) -> Array | None:
        """Return the point of a curve near x on the plane through x; None if there is none."""
        place = normal @ x
        with np.errstate(all="ignore"):
            for _ in range(NEWTON_STEPS):
                g, J = self._slopes(x)
                if not np.isfinite(J).all():
                    return None
                left = np.append(-g, place - normal @ x)
                # At a pitchfork the equations are singular: the shortest step stays on the curve.
                step = np.linalg.lstsq(np.vstack([J, normal]), left, 1e-9)[0]
                x = x + step
                if np.abs(step).max() < ARRIVED:
                    return x
        return None

    def _way(self, start: Array, sign: float) -> list[Array]:
        """Return the points of a curve beyond one of its points, to an end, or to this point."""

        def tangent(x: Array) -> Array:
            return np.asarray(np.linalg.svd(self._slopes(x)[1])[2][3])

        points, x, t, step = list[Array](), start, sign * tangent(start), STEP
        while len(points) < MOST_STEPS and step > SHORTEST:
            ahead = x + step * t
            p = min(max(ahead[3], 0.0), 1.0)
            is_last = p != ahead[3]
            new = self._on_plane(np.append(ahead[:3], p), ACROSS if is_last else t)
            turned = None if new is None or not RANGE.contains(new[:3]) else tangent(new)
            if new is None or turned is None or abs(turned @ t) < STRAIGHT:
                step /= 2
                continue
            points.append(new)
            if is_last:
                break
            x, t, step = new, turned * np.sign(turned @ t), min(1.3 * step, LONGEST)
            if np.linalg.norm(x - start) < 0.6 * step:
                return [*points, start]
        return points

    def _add(self, points: list[Array]) -> None:
        """Add a curve, with its turns among its points."""
        rows = [(x, int((self._eigenvalues(x) < 0).sum())) for x in points]
        places = rows[:1]
        for (a, before), (b, after) in pairwise(rows):
            numbers = range(before, after) if before < after else range(before - 1, after - 1, -1)
            places += [(self._turn(a, b, number), number + 1) for number in numbers]
            places.append((b, after))
        curve, of_points = map(np.array, zip(*places, strict=True))
        values = self.low + self.width * curve[:, 3]
        self.curves.append(Branch(values, curve[:, :3], of_points))

    def _eigenvalues(self, x: Array) -> Array:
        return np.linalg.eigvalsh(self._slopes(x)[1][:, :3])

    def _turn(self, a: Array, b: Array, number: int) -> Array:
        """Return where an eigenvalue is zero between two points of a curve, and name it."""
        from scipy.optimize import brentq  # imported late, as it takes long

        def between(share: float) -> Array:
            x = a + share * (b - a)
            end = self._on_plane(x, b - a)
            return x if end is None else end

        def eigenvalue(share: float) -> float:
            return float(self._eigenvalues(between(share))[number])

        # The ends may be turns to round-off.
        crosses = eigenvalue(0.0) * eigenvalue(1.0) < 0
        x = between(brentq(eigenvalue, 0.0, 1.0, xtol=1e-12) if crosses else 0.0)
        folds = (x[3] - a[3]) * (b[3] - x[3]) < 0
        kind = "fold" if folds else "pitchfork" if self._is_even(x, number) else "crossing"
        # Another curve, or another eigenvalue, may have the same turn.
        same = tuple(np.round(x, 4).tolist())
        self.turns[same] = Turn(kind, float(self.low + x[3] * self.width), x[:3])
        return x

    def _is_even(self, x: Array, number: int) -> bool:
        """Return whether the third derivative of V along an eigenvector is zero."""
        values, vectors = np.linalg.eigh(self._slopes(x)[1][:, :3])
        way = np.append(SIDEWAYS * vectors[:, number], 0.0)
        # Along the eigenvector it is the slope of the eigenvalue.
        ahead, behind = (self._eigenvalues(x + side)[number] for side in (way, -way))
        return bool(abs(ahead - behind) < 2 * SIDEWAYS * ODD * np.abs(values).max())
