"""Bounds on the derivatives of the energies of all bodies in a box, over boxes of Θ.

With the centre m of a box, δ = (Θ - m, z), and the matrices of the forms in place of their sums,

    ∇U = g_0 + H_0 δ + Σ w_j (g_j + H_j δ) + rest,

so y'∇U is not zero if |y'g_0| > |y'H_0| r + Σ (|y'g_j| + |y'H_j| r) + |y'| |rest|: a body has the
same weight w_j in all components. Whatever is proved from these bounds holds for each body.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.bounds import UP
from rbstab.proof.enclosures.compiled import Compiled, derivatives
from rbstab.proof.enclosures.intervals import Intervals
from rbstab.proof.enclosures.taylor import Values, slopes_of_one
from rbstab.proof.exact.expr import Expr
from rbstab.proof.model import COSINE, HALVES, THETA
from rbstab.proof.robust.forms import Forms
from rbstab.proof.robust.numbers import FIRST, ONE, REMAINDERS

ROUNDING = 2.0**-52

LEAST = {COSINE: 0.0, **dict.fromkeys(HALVES.values(), 0.0)}
"""Lower bounds of cosines in the range of eq. 5."""


@dataclass(frozen=True, eq=False)
class Sums:
    """A derivative of all bodies: that of f_0, those of all forms, and a bound on the errors."""

    middle: Array
    others: Array
    error: Array

    @property
    def size(self) -> Array:
        """A bound on the magnitude for each body."""
        return np.asarray((np.abs(self.middle) + np.abs(self.others).sum(axis=0) + self.error) * UP)


class Family:
    """The energies of all bodies in a box, with proved bounds.

    Args:
        forms: The energies.
    """

    def __init__(self, forms: Forms) -> None:
        self.forms, self.n = forms, 3 + len(forms.inner)
        self.count = len(forms.functions)
        results = [*forms.functions, *(Expr({m: ONE}) for m in forms.left.entries)]
        self.variables = (*THETA, *forms.inner)
        leaves = {v: (i,) for i, v in enumerate(self.variables)}
        self.compiled = Compiled(results, self.n, leaves, 3, LEAST)
        self.points = Compiled(results, self.n, leaves, 2, LEAST)
        places = derivatives(self.n, 3)
        self.first, self.second, self.third = places.first, places.second, places.third[:3]
        self.size = np.abs(forms.middle) + np.abs(forms.others).sum(axis=0)
        # Coefficients are rounded, and then sums over functions, forms and axes.
        self.epsilon = (2 * self.count + 60) * ROUNDING

    @property
    def batch(self) -> int:
        """How many boxes are worth bounding at once."""
        return int(min(1024, max(64, 200_000 // max(1, len(self.forms.others)))))

    def _derivatives(self, values: Values) -> Intervals:
        """Return the derivatives of all functions, shape (functions, coefficients, boxes)."""
        places = range(len(values.compiled.results))
        return Intervals.of(np.stack([values.derivatives(k) for k in places]))

    def sums(self, of: Intervals, places: Array) -> Sums:
        """Return Σ C_0 μ and all Σ C_j μ of the derivatives at some places."""
        with np.errstate(all="ignore"):
            mid, rad = of.mid[: self.count, places], of.rad[: self.count, places]
            middle = np.tensordot(self.forms.middle, mid, 1)
            others = np.tensordot(self.forms.others, mid, 1)
            error = np.tensordot(self.size, rad + self.epsilon * np.abs(mid), 1) * UP + 1e-290
        return Sums(middle, others, error)

    def sizes(self, of: Intervals, places: Array) -> Array:
        """Return bounds on the magnitudes of the derivatives at some places, for all bodies."""
        rows, back = np.unique(places, return_inverse=True)
        with np.errstate(all="ignore"):
            return np.asarray(self.sums(of, rows).size[back.reshape(places.shape)])

    def over(self, lo: Array, hi: Array) -> "Over":
        """Return bounds over boxes from lo to hi, both of shape (3, boxes)."""
        ends = np.ones((self.n - 3, lo.shape[1]))
        centre = 0.5 * lo + 0.5 * hi
        middle = np.vstack([centre, 0 * ends])
        wide = np.nextafter(np.maximum(hi - centre, centre - lo), np.inf)
        radius = np.vstack([wide, ends])
        low, high = np.vstack([lo, -ends]), np.vstack([hi, ends])
        tightened = bool(self.compiled.tightened)
        compiled = self.compiled if tightened else self.points
        at, over = (
            slopes_of_one(self.variables, np.stack(ends, 1))
            for ends in ((middle, middle), (low, high))
        )
        about = Values(compiled, at)
        values = Values(self.compiled, over, about if tightened else None, radius)
        c, o = self._derivatives(about), self._derivatives(values)
        return Over(self, centre, radius, c, o)

    def remainder(self, o: Intervals) -> tuple[Array, Array, Array]:
        """Bound ½ q'Rq with 0 <= R <= F'F, its gradient and Hessian by Θ over boxes."""
        left, m = self.forms.left, o.lo.shape[-1]
        if not left.left.size:
            return np.zeros(m), np.zeros((3, m)), np.zeros((3, 3, m))
        e = slice(self.count, None)
        places = np.concatenate([[0], self.first[:3], self.second[:3, :3].ravel()])
        mid, rad = o.mid[e, places], o.rad[e, places]
        found = np.abs(np.einsum("ajk,kcm->ajcm", left.left, mid)).sum(axis=0)
        found = found + np.einsum("jk,kcm->jcm", np.abs(left.left).sum(axis=0), rad)
        found = found + np.einsum("jk,kcm->jcm", left.rounding, np.abs(mid) + rad)
        norm = np.sqrt((found**2).sum(axis=0)) * UP
        N0, N1, N2 = norm[0], norm[1:4], norm[4:].reshape(3, 3, m)
        return 0.5 * N0**2 * UP, N0 * N1 * UP, (N0 * N2 + N1[:, None] * N1[None]) * UP

    def at(self, points: Array) -> tuple[Array, Array]:
        """Return ∇U and ∇²U by Θ of the body in the middle at points (3, m), to round-off."""
        _, slopes, bends = self._at_points(points)
        return slopes, bends[:, :3]

    def gradients(self, points: Array) -> tuple[Array, Array, Array]:
        """Return ∇U of the body in the middle at points, and how each number of the box changes it.

        The change of ∇²U follows, but for numbers inside of functions. Shapes (3, points),
        (numbers, 3, points) and (numbers, 9, points), to round-off.
        """
        mid, slopes, bends = self._at_points(points)
        changes, bent = (
            np.tensordot(self.forms.linear, mid[:, places], 1)
            for places in (self.first[:3], self.second[:3, :3].ravel())
        )
        for k, v in enumerate(self.forms.inner):
            if v < REMAINDERS:
                changes[v - FIRST] += bends[:, 3 + k]
        return slopes, changes, bent

    def _at_points(self, points: Array) -> tuple[Array, Array, Array]:
        """Return the derivatives of all functions, ∇U, and the rows of ∇²U by Θ."""
        count = points.shape[1]
        middle = np.vstack([points, np.zeros((self.n - 3, count))])
        at = Values(self.points, slopes_of_one(self.variables, middle[:, None]))
        each = [at.derivatives(k) for k in range(self.count)]
        mid = np.array(each).reshape(self.count, -1, count)
        f = np.tensordot(self.forms.middle, mid, 1)
        return mid, f[self.first[:3]], f[self.second[:3]]


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
    def slope(self) -> Sums:
        """∇U by Θ at the centres: g_0 and g_j."""
        return self.family.sums(self.c, self.family.first[:3])

    @cached_property
    def bend(self) -> Sums:
        """∇²U at the centres, rows by Θ and columns by δ: H_0 and H_j."""
        return self.family.sums(self.c, self.family.second[:3])

    @cached_property
    def third(self) -> Array:
        """Bounds on the third derivatives over the boxes, the first by Θ, (3, n, n, boxes)."""
        return self.family.sizes(self.o, self.family.third)

    @cached_property
    def remainder(self) -> tuple[Array, Array, Array]:
        """Bounds on what elimination leaves, its gradient and Hessian by Θ."""
        with np.errstate(all="ignore"):
            return self.family.remainder(self.o)

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
        """∇U over the boxes by intervals, with infinite ends where a function has a pole."""
        return self._plain(self.family.first[:3], self.remainder[1])

    @cached_property
    def plain_value(self) -> Intervals:
        """U over the boxes, likewise."""
        return self._plain(np.array([0]), self.remainder[0])[0]

    def _plain(self, places: Array, remainder: Array) -> Intervals:
        f = self.family
        size = np.abs(f.forms.middle) * ROUNDING + (f.size - np.abs(f.forms.middle)) * UP
        mine = self.o[: f.count, places]
        coefficients = [
            np.broadcast_to(x[:, None, None], np.shape(mine.lo))
            for x in (f.forms.middle - size, f.forms.middle + size)
        ]
        with np.errstate(all="ignore"):
            terms = Intervals(*coefficients) * mine
            low, high = (
                end.sum(axis=0) + side * (f.epsilon * np.abs(end).sum(axis=0) + remainder)
                for side, end in ((-1, terms.lo), (1, terms.hi))
            )
        return Intervals(low, high)

    def along(self, y: Array, *, at_centre: bool = False) -> tuple[Array, Array]:
        """Return y'g_0 and a bound on the rest of y'∇U, both of shape (boxes,).

        Args:
            y: The directions, shape (3, boxes).
            at_centre: Whether only Θ = m counts, but all bodies.
        """
        g, H, r = self.slope, self.bend, self.radius.copy()
        turned = np.abs(np.einsum("ijm,im->jm", H.middle, y))
        turned = turned + np.abs(np.einsum("fijm,im->fjm", H.others, y)).sum(axis=0)
        if at_centre:
            r[:3] = 0.0
        spread = np.abs(np.einsum("fim,im->fm", g.others, y)).sum(axis=0)
        spread = spread + np.einsum("jm,jm->m", turned, r)
        if not at_centre:
            spread = spread + np.einsum("im,im->m", np.abs(y), self.rest)
        return np.einsum("im,im->m", g.middle, y), spread * UP

    def excluded(self, y: Array, side: int = 0) -> Array:
        """Return in which boxes y'∇U has one sign for all bodies, shape (boxes,).

        Args:
            y: The directions, shape (3, boxes).
            side: 0, or the sign of θ2 at a stop. Then no body is held there either: where it is,
                ∇U = (0, -λ side, 0) with λ >= 0.
        """
        rise, spread = self.along(y)
        up, down = rise > spread, -rise > spread
        if side:
            up, down = up & (side * y[1] >= 0), down & (side * y[1] <= 0)
        return np.asarray(up | down)

    def rises(self, side: int = 0) -> Array:
        """Return in which boxes a slope of U has one sign for all bodies by its terms alone."""
        up, down = self.plain.lo > 0, self.plain.hi < 0
        if side:
            up[1], down[1] = (up[1], False) if side > 0 else (False, down[1])
        return np.asarray(np.any(up | down, axis=0))

    def curvature(self) -> tuple[Array, Array, Array]:
        """Return ∇²U by Θ of all bodies at the first centre: H_0, all H_j, and a bound on the rest.

        That a number inside of functions changes is one more H_j: half of its range times ∂∇²U.
        """
        H, t = self.bend, self.family.sums(self.o, self.family.third[:, :3, 3:])
        left = (np.abs(t.others[..., 0]).sum(axis=0) + t.error[..., 0]).sum(axis=2) * UP
        others = np.concatenate([H.others[:, :, :3, 0], np.moveaxis(t.middle[..., 0], 2, 0)])
        return H.middle[:, :3, 0], others, H.error[:, :3, 0] + left

    @property
    def change(self) -> Array:
        """Bounds on how ∇²U changes with Θ within the boxes, and on the remainder's Hessian."""
        moved = np.einsum("ijkm,km->ijm", self.third[:, :3, :3], self.radius[:3])
        return np.asarray((moved + self.remainder[2]) * UP)
