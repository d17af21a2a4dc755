"""Bounds on the derivatives of the energies of all bodies in a box, over boxes of Θ.

With the centre m of a box, δ = (Θ - m, z), and the matrices of the forms in place of their sums,

    ∇U = g_0 + H_0 δ + Σ w_j (g_j + H_j δ) + rest,

so y'∇U is not zero if |y'g_0| > |y'H_0| r + Σ (|y'g_j| + |y'H_j| r) + |y'| |rest|: a body has the
same weight w_j in all components. Whatever is proved from these bounds holds for each body.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.bounds import UP
from rbstab.proof.enclosures.compiled import Compiled, derivatives
from rbstab.proof.enclosures.intervals import Intervals, product
from rbstab.proof.enclosures.points import AtPoints, variables_at
from rbstab.proof.enclosures.taylor import Values, variables_over
from rbstab.proof.exact.expr import Expr
from rbstab.proof.model import COSINE, HALVES, THETA
from rbstab.proof.robust.energies import Energies
from rbstab.proof.robust.numbers import FIRST

ROUNDING = 2.0**-52

LEAST = {COSINE: 0.0, **dict.fromkeys(HALVES.values(), 0.0)}
"""Lower bounds of cosines in the range of eq. 5."""


@dataclass(frozen=True, eq=False)
class Sums:
    """Derivatives of all bodies: of f_0, of all forms, and bounds on the errors.

    Their shapes are (..., boxes), (forms, ..., boxes) and (..., boxes).
    """

    middle: Array
    others: Array
    error: Array

    def __getitem__(self, place: int | slice) -> "Sums":
        """Return some of them."""
        return Sums(self.middle[place], self.others[:, place], self.error[place])

    @property
    def size(self) -> Array:
        """A bound on the magnitude for each body."""
        return np.asarray((np.abs(self.middle) + np.abs(self.others).sum(axis=0) + self.error) * UP)


class Family:
    """The energies of all bodies in a box, with proved bounds.

    Args:
        energies: The energies.
    """

    def __init__(self, energies: Energies) -> None:
        self.energies, self.n = energies, 3 + len(energies.inner)
        self.count = len(energies.functions)
        results = [Expr({m: Fraction(1)}) for m in (*energies.functions, *energies.entries)]
        self.variables = (*THETA, *energies.inner)
        leaves = {v: (i,) for i, v in enumerate(self.variables)}
        self.compiled = Compiled(results, self.n, leaves, 3, LEAST)
        self.first, self.second, self.third, _ = derivatives(self.n, 3)
        # Coefficients of each body are within `spread` of C_0.
        self.spread = np.abs(energies.others).sum(axis=0) * UP
        self.spread += ROUNDING * np.abs(energies.middle)
        self.size = np.abs(energies.middle) + self.spread
        # Coefficients are rounded, and then sums over functions, forms and axes.
        self.epsilon = (2 * self.count + 60) * ROUNDING

    @property
    def batch(self) -> int:
        """How many boxes are worth bounding at once."""
        return int(min(1024, max(64, 200_000 // max(1, len(self.energies.others)))))

    def sums(self, of: Intervals, places: Array) -> Sums:
        """Return Σ C_0 μ and all Σ C_j μ of the derivatives at some places."""
        with np.errstate(all="ignore"):
            mid, rad = of.mid[: self.count, places], of.rad[: self.count, places]
            middle = np.tensordot(self.energies.middle, mid, 1)
            others = np.tensordot(self.energies.others, mid, 1)
            error = np.tensordot(self.size, rad + self.epsilon * np.abs(mid), 1) * UP + 1e-290
        return Sums(middle, others, error)

    def sizes(self, of: Intervals, places: Array) -> Array:
        """Return bounds on the magnitudes of the derivatives at some places, for all bodies."""
        rows, back = np.unique(places, return_inverse=True)
        with np.errstate(all="ignore"):
            return np.asarray(self.sums(of, rows).size[back.reshape(places.shape)])

    def over(self, lo: Array, hi: Array) -> "Over":
        """Return bounds over boxes from lo to hi, both of shape (3, boxes)."""
        ends, centre = np.ones((self.n - 3, lo.shape[1])), 0.5 * lo + 0.5 * hi
        middle = np.vstack([centre, 0 * ends])
        wide = np.nextafter(np.maximum(hi - centre, centre - lo), np.inf)
        radius = np.vstack([wide, ends])
        low, high = np.vstack([lo, -ends]), np.vstack([hi, ends])
        at = Values(self.compiled, variables_over(self.variables, middle, middle))
        boxes = variables_over(self.variables, low, high)
        over = Values(self.compiled, boxes, at, radius)
        at_centre, over_box = (self._derivatives(one, lo.shape[1]) for one in (at, over))
        return Over(self, centre, radius, at_centre, over_box)

    def _derivatives(self, values: Values, boxes: int) -> Intervals:
        """Return the derivatives of all functions, shape (functions, coefficients, boxes)."""
        with np.errstate(all="ignore"):
            each = [values.derivatives(k, boxes) for k in range(len(self.compiled.results))]
        return Intervals(np.stack([one.lo for one in each]), np.stack([one.hi for one in each]))

    def at(self, points: Array) -> "Slopes":
        """Return the slopes of U at points of shape (3, points), to round-off."""
        count = points.shape[1]
        middle = np.vstack([points, np.zeros((self.n - 3, count))])
        with np.errstate(all="ignore"):
            at = AtPoints(self.compiled, variables_at(self.variables, middle))
            mu = np.stack([at.derivatives(k, count) for k in range(self.count)])
        f, by_weight = (
            np.tensordot(C, mu, 1) for C in (self.energies.middle, self.energies.linear)
        )
        bends, changes = f[self.second[:3]], by_weight[:, self.first[:3]]
        for k, v in enumerate(self.energies.inner):
            changes[v - FIRST] += bends[:, 3 + k]
        return Slopes(f[self.first[:3]], bends[:, :3], changes, by_weight[:, self.second[:3, :3]])


class Slopes(NamedTuple):
    """Slopes at points, and how each number of the box changes them, to first order.

    Attributes:
        gradient: ∇U by Θ of the body in the middle, shape (3, points).
        hessian: ∇²U of it, shape (3, 3, points).
        changes: The change of ∇U with each number, shape (numbers, 3, points).
        bends: That of ∇²U, but for numbers inside of functions, shape (numbers, 3, 3, points).
    """

    gradient: Array
    hessian: Array
    changes: Array
    bends: Array


class Over:
    """Bounds over boxes, each computed when it is asked for.

    Args:
        family: The energies.
        centre: The centres, shape (3, boxes).
        radius: The radii r of δ, shape (n, boxes).
        c: The derivatives of all functions at the centres, with all z at 0.
        o: Those over the boxes.
    """

    def __init__(
        self, family: Family, centre: Array, radius: Array, c: Intervals, o: Intervals
    ) -> None:
        self.family, self.centre, self.radius, self.c, self.o = family, centre, radius, c, o

    @cached_property
    def linear(self) -> Sums:
        """U and its slopes by δ at the centres, shape (1 + n, boxes)."""
        return self.family.sums(self.c, np.append(0, self.family.first))

    @cached_property
    def slope(self) -> Sums:
        """∇U by Θ at the centres: g_0 and g_j."""
        return self.linear[1:4]

    @cached_property
    def bend(self) -> Sums:
        """∇²U at the centres, rows by Θ and columns by δ: H_0 and H_j."""
        return self.family.sums(self.c, self.family.second[:3])

    @cached_property
    def third(self) -> Array:
        """Bounds on the third derivatives over the boxes, the first by Θ, (3, n, n, boxes)."""
        return self.family.sizes(self.o, self.family.third[:3])

    @cached_property
    def remainder(self) -> tuple[Array, Array, Array]:
        """Bounds on ½ q'Rq over the boxes, which elimination leaves, its gradient and Hessian."""
        f, m = self.family, self.centre.shape[1]
        left = f.energies.left
        if not left.size:
            return np.zeros(m), np.zeros((3, m)), np.zeros((3, 3, m))
        places = np.concatenate([[0], f.first[:3], f.second[:3, :3].ravel()])
        with np.errstate(all="ignore"):
            mid, rad = (x[f.count :, places] for x in (self.o.mid, self.o.rad))
            found = np.abs(np.einsum("ajk,kcm->ajcm", left, mid)).sum(axis=0)
            error = rad + f.epsilon * np.abs(mid)
            found += np.einsum("jk,kcm->jcm", np.abs(left).sum(axis=0), error)
            norm = np.sqrt((found**2).sum(axis=0)) * UP
            N0, N1, N2 = norm[0], norm[1:4], norm[4:].reshape(3, 3, m)
            return 0.5 * N0**2 * UP, N0 * N1 * UP, (N0 * N2 + N1[:, None] * N1[None]) * UP

    @cached_property
    def rest(self) -> Array:
        """A bound on the rest of ∇U, with all rounding, shape (3, boxes)."""
        f, r, places = self.family, self.radius, self.family.second[:3]
        with np.errstate(all="ignore"):
            by_third = 0.5 * np.einsum("ijkm,jm,km->im", self.third, r, r)
            # |(∇²U(ξ) - ∇²U(m)) δ| from the second derivatives over the boxes.
            low, high = self.c[: f.count, places], self.o[: f.count, places]
            away = np.maximum(high.hi - low.lo, low.hi - high.lo)
            by_second = np.einsum("ijm,jm->im", np.tensordot(f.size, away, 1) * UP, r)
            found = self.slope.error + np.einsum("ijm,jm->im", self.bend.error, r)
            return np.asarray((found + np.fmin(by_third, by_second) * UP + self.remainder[1]) * UP)

    @cached_property
    def plain(self) -> Intervals:
        """U and ∇U over the boxes by intervals, with infinite ends where a function has a pole."""
        f = self.family
        mine = self.o[: f.count, np.append(0, f.first[:3])]
        C = f.energies.middle
        ends = (x[:, None, None] + np.zeros(mine.lo.shape) for x in (C - f.spread, C + f.spread))
        left = np.vstack([self.remainder[0], self.remainder[1]])
        with np.errstate(all="ignore"):
            terms = product(Intervals(*ends), mine)
            low, high = (
                end.sum(axis=0) + side * (f.epsilon * np.abs(end).sum(axis=0) + left)
                for side, end in ((-1, terms.lo), (1, terms.hi))
            )
        return Intervals(low, high)

    def along(self, y: Array) -> tuple[Array, Array, Array]:
        """Return y'g_0 and bounds on the rest of y'∇U, each of shape (boxes,).

        The first bound is for Θ = m alone, and the second over the boxes.

        Args:
            y: The directions, shape (3, boxes).
        """
        g, H, r = self.slope, self.bend, self.radius
        turned = np.abs(np.einsum("ijm,im->jm", H.middle, y))
        turned = turned + np.abs(np.einsum("fijm,im->fjm", H.others, y)).sum(axis=0)
        centre = np.abs(np.einsum("fim,im->fm", g.others, y)).sum(axis=0)
        centre = centre + np.einsum("jm,jm->m", turned[3:], r[3:])
        over = centre + np.einsum("jm,jm->m", turned[:3], r[:3])
        over = over + np.einsum("im,im->m", np.abs(y), self.rest)
        # Tiny y round to zero.
        return np.einsum("im,im->m", g.middle, y), centre * UP + 1e-290, over * UP + 1e-290

    def excluded(self, y: Array, side: int = 0) -> tuple[Array, Array]:
        """Return in which boxes y'∇U has one sign for all bodies, and at which centres.

        Args:
            y: The directions, shape (3, boxes).
            side: 0, or the sign of θ2 at a stop. Then no body is held in these boxes either: where
                it is, ∇U = (0, -λ side, 0) with λ >= 0.
        """
        rise, at_centre, spread = self.along(y)
        up, down = rise > spread, -rise > spread
        if side:
            up, down = up & (side * y[1] >= 0), down & (side * y[1] <= 0)
        return up | down, np.abs(rise) > at_centre

    def rises(self, side: int = 0) -> Array:
        """Return in which boxes a slope of U has one sign for all bodies by its terms alone."""
        up, down = self.plain.lo[1:] > 0, self.plain.hi[1:] < 0
        if side:
            up[1], down[1] = (up[1], False) if side > 0 else (False, down[1])
        return np.asarray(np.any(up | down, axis=0))

    def curvature(self) -> Sums:
        """Return ∇²U by Θ of all bodies at the first centre: H_0, all H_j, and a bound on the rest.

        That a number inside of functions changes is one more H_j: half of its range times ∂∇²U.
        """
        H, t = self.bend, self.family.sums(self.o, self.family.third[:3, :3, 3:])
        left = (np.abs(t.others[..., 0]).sum(axis=0) + t.error[..., 0]).sum(axis=2) * UP
        others = np.concatenate([H.others[:, :, :3, 0], np.moveaxis(t.middle[..., 0], 2, 0)])
        return Sums(H.middle[:, :3, 0], others, H.error[:, :3, 0] + left)

    @property
    def change(self) -> Array:
        """Bounds on how ∇²U changes with Θ within the boxes, and on the remainder's Hessian."""
        moved = np.einsum("ijkm,km->ijm", self.third[:, :3, :3], self.radius[:3])
        return np.asarray((moved + self.remainder[2]) * UP)
