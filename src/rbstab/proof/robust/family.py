"""Bounds on the derivatives of the energies of all bodies in a box, over boxes of Θ.

With the centre m of a box, δ = (Θ - m, z), and the matrices of the forms in place of their sums,

    ∇U = g_0 + H_0 δ + Σ w_j (g_j + H_j δ) + rest,

so y'∇U is not zero if |y'g_0| > |y'H_0| r + Σ (|y'g_j| + |y'H_j| r) + |y'| |rest|: a body has the
same weight w_j in all components. Whatever is proved from these bounds holds for each body.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.bounds import UP
from rbstab.proof.enclosures.compiled import Compiled, derivatives
from rbstab.proof.enclosures.intervals import Intervals
from rbstab.proof.enclosures.taylor import Values, unit_slopes
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


class Rows:
    """The coefficients of functions μ for all bodies: C_0 + Σ w_j C_j.

    Args:
        middle: C_0, shape (..., μ).
        others: C_j, shape (forms, ..., μ).
    """

    def __init__(self, middle: Array, others: Array) -> None:
        self.middle, self.others = middle, others
        # Those of each body are within `spread` of C_0.
        self.spread = np.abs(others).sum(axis=0) * UP + ROUNDING * np.abs(middle)
        self.size = np.abs(middle) + self.spread
        # Coefficients are rounded, and then sums over functions, forms and axes.
        self.epsilon = (2 * middle.shape[-1] + 60) * ROUNDING

    @np.errstate(all="ignore")
    def sums(self, of: Intervals) -> Sums:
        """Return Σ C_0 μ and all Σ C_j μ of derivatives of μ, shape (μ, derivatives, boxes)."""
        error = np.tensordot(self.size, of.rad + self.epsilon * np.abs(of.mid), 1) * UP + 1e-290
        middle, others = (np.tensordot(C, of.mid, 1) for C in (self.middle, self.others))
        return Sums(middle, others, error)


class Family:
    """The energies of all bodies in a box, with proved bounds.

    Args:
        energies: The energies.
    """

    def __init__(self, energies: Energies) -> None:
        self.energies, self.n = energies, 3 + len(energies.inner)
        self.count = len(energies.functions)
        self.results = [Expr({m: Fraction(1)}) for m in (*energies.functions, *energies.entries)]
        self.variables = (*THETA, *energies.inner)
        leaves = {v: (i,) for i, v in enumerate(self.variables)}
        self.compiled = Compiled(self.results, self.n, leaves, 3, LEAST)
        self.first, self.second, self.third, _ = derivatives(self.n, 3)
        self.U = Rows(energies.middle, energies.others)
        self.left = Rows(energies.left[0], energies.left[1:])

    @property
    def batch(self) -> int:
        """How many boxes are worth bounding at once."""
        return int(min(1024, max(64, 200_000 // max(1, len(self.U.others)))))

    def sums(self, of: Intervals, places: Array) -> Sums:
        """Return some derivatives of U for all bodies, from those of all functions."""
        return self.U.sums(of[: self.count, places])

    def sizes(self, of: Intervals, places: Array) -> Array:
        """Return bounds on their magnitudes; places that occur twice are computed once."""
        rows, back = np.unique(places, return_inverse=True)
        return np.asarray(self.sums(of, rows).size[back.reshape(places.shape)])

    def over(self, lo: Array, hi: Array) -> "Over":
        """Return bounds over boxes from lo to hi, both of shape (3, boxes)."""
        return Over(self, lo, hi)


class Over:
    """Bounds over boxes, each computed when it is asked for.

    Args:
        family: The energies.
        lo: The lower ends of the boxes, shape (3, boxes).
        hi: The upper ends.
    """

    def __init__(self, family: Family, lo: Array, hi: Array) -> None:
        self.family, self.lo, self.hi = family, lo, hi
        self.centre, self.ends = 0.5 * lo + 0.5 * hi, np.ones((family.n - 3, lo.shape[1]))
        wide = np.nextafter(np.maximum(hi - self.centre, self.centre - lo), np.inf)
        # The radii r of δ, shape (n, boxes).
        self.radius = np.vstack([wide, self.ends])

    def _values(self, lo: Array, hi: Array, z: Array, about: Values | None = None) -> Values:
        ends = np.stack([np.vstack([lo, -z]), np.vstack([hi, z])], 1)
        of = unit_slopes(self.family.variables, ends)
        return Values(self.family.compiled, of, about, self.radius)

    def _derivatives(self, of: Values) -> Intervals:
        """Return the derivatives of all functions, shape (functions, coefficients, boxes)."""
        places = range(len(self.family.results))
        return Intervals.of(np.stack([of.derivatives(k) for k in places]))

    @cached_property
    def _at_centre(self) -> Values:
        return self._values(self.centre, self.centre, 0 * self.ends)

    @cached_property
    def c(self) -> Intervals:
        """The derivatives of all functions at the centres, with all z at 0."""
        return self._derivatives(self._at_centre)

    @cached_property
    def o(self) -> Intervals:
        """The derivatives of all functions over the boxes."""
        return self._derivatives(self._values(self.lo, self.hi, self.ends, self._at_centre))

    def by_number(self) -> tuple[Array, Array]:
        """Return how each number of the box changes ∇U and ∇²U at the centres, to first order.

        That of ∇²U is without the numbers inside of functions. Their shapes are
        (numbers, 3, boxes) and (numbers, 3, 3, boxes).
        """
        energies, H = self.family.energies, self.bend
        changes = self.slope.others[: energies.numbers].copy()
        for k, v in enumerate(energies.inner):
            changes[v - FIRST] += H.middle[:, 3 + k]
        return changes, H.others[: energies.numbers, :, :3]

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
        f = self.family
        places = np.concatenate([[0], f.first[:3], f.second[:3, :3].ravel()])
        with np.errstate(all="ignore"):
            sizes = f.left.sums(self.o[f.count :, places]).size
            norm = np.sqrt((sizes**2).sum(axis=0)) * UP
            N0, N1, N2 = norm[0], norm[1:4], norm[4:].reshape(3, 3, -1)
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
            by_second = np.einsum("ijm,jm->im", np.tensordot(f.U.size, away, 1) * UP, r)
            error = self.slope.error + np.einsum("ijm,jm->im", self.bend.error, r)
            return np.asarray((error + np.fmin(by_third, by_second) * UP + self.remainder[1]) * UP)

    @cached_property
    def plain(self) -> Intervals:
        """U and ∇U over the boxes by intervals, with infinite ends where a function has a pole."""
        f = self.family
        functions = self.o[: f.count, np.append(0, f.first[:3])]
        ends = (f.U.middle + side * f.U.spread for side in (-1, 1))
        C = Intervals(*(np.broadcast_to(x[:, None, None], functions.lo.shape) for x in ends))
        left = np.vstack([self.remainder[0], self.remainder[1]])
        with np.errstate(all="ignore"):
            terms = C * functions
            low, high = (
                end.sum(axis=0) + side * (f.U.epsilon * np.abs(end).sum(axis=0) + left)
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
        seen = _seen(rise > spread, -rise > spread, side * y[1])
        return seen, np.abs(rise) > at_centre

    def rises(self, side: int = 0) -> Array:
        """Return in which boxes a slope of U has one sign for all bodies by its terms alone."""
        up, down = self.plain.lo[1:] > 0, self.plain.hi[1:] < 0
        return np.asarray(np.any(_seen(up, down, side * np.eye(3)[1][:, None]), axis=0))

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


def _seen(up: Array, down: Array, outwards: Array) -> Array:
    """Return where no body rests, as its slope along y rises or falls."""
    # On the face of a stop `outwards` is y2 times the side: the slopes of a body that presses
    # against the stop do not count.
    return np.asarray((up & (outwards >= 0)) | (down & (outwards <= 0)))
