"""Bounds on the derivatives of the energies of all bodies in a box, over boxes of Θ.

With the centre m of a box, δ = (Θ - m, z), and the matrices of the forms in place of their sums,

    ∇U = g_0 + H_0 δ + Σ w_j (g_j + H_j δ) + rest,

so y'∇U is not zero if |y'g_0| > |y'H_0| r + Σ (|y'g_j| + |y'H_j| r) + |y'| |rest|: a body has the
same weight w_j in all components. Whatever is proved from these bounds holds for each body.
"""

from dataclasses import dataclass
from functools import cached_property
from math import factorial, prod

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.bounds import UP
from rbstab.proof.enclosures.intervals import Intervals, product
from rbstab.proof.enclosures.taylor import Compiled, Values, exponents
from rbstab.proof.exact.expr import Expr
from rbstab.proof.model import COSINE, HALVES, THETA
from rbstab.proof.robust.forms import Forms
from rbstab.proof.robust.numbers import FIRST, ONE, REMAINDERS

ROUNDING = 2.0**-52

LEAST = {COSINE: 0.0, **dict.fromkeys(HALVES.values(), 0.0)}
"""Lower bounds of cosines in the range of eq. 5."""


@dataclass(frozen=True, eq=False)
class Local:
    """∇U of all bodies over boxes, as in the head of this module.

    Args:
        centre: The centres, shape (3, boxes).
        radius: The radii r of δ, shape (n, boxes).
        gradient: g_0 and g_j, shapes (3, boxes) and (forms, 3, boxes).
        hessian: H_0 and H_j, rows by Θ and columns by δ, shapes (3, n, boxes) and
            (forms, 3, n, boxes).
        rest: A bound on all else, with all rounding, shape (3, boxes).
        slopes: ∇U over the boxes from its terms: of f_0, of the forms, and their errors.
        plain: The same as intervals, with infinite ends where a function has a pole.
    """

    centre: Array
    radius: Array
    gradient: tuple[Array, Array]
    hessian: tuple[Array, Array]
    rest: Array
    slopes: tuple[Array, Array, Array]
    plain: Intervals

    def along(self, y: Array, *, at_centre: bool = False) -> tuple[Array, Array]:
        """Return y'g_0 and a bound on the rest of y'∇U, both of shape (boxes,).

        Args:
            y: The directions, shape (3, boxes).
            at_centre: Whether only Θ = m counts, but all bodies.
        """
        r = self.radius.copy()
        if at_centre:
            r[:3] = 0.0
        size = np.abs(y)
        spread = np.einsum("im,im->m", size, self.rest)
        if at_centre:
            spread = np.zeros_like(spread)
        for of, gradient, hessian in (
            (0, self.gradient[0][None], self.hessian[0][None]),
            (1, self.gradient[1], self.hessian[1]),
        ):
            if of:
                spread = spread + np.abs(np.einsum("fim,im->fm", gradient, y)).sum(axis=0)
            turned = np.abs(np.einsum("fijm,im->fjm", hessian, y)).sum(axis=0)
            spread = spread + np.einsum("jm,jm->m", turned, r)
        return np.einsum("im,im->m", self.gradient[0], y), spread * UP

    def excluded(self, y: Array, side: int = 0) -> Array:
        """Return in which boxes y'∇U has one sign for all bodies, shape (boxes,).

        Args:
            y: The directions, shape (3, boxes).
            side: 0, or the sign of θ2 at a stop. Then no body is held there either: where it is,
                ∇U = (0, -λ side, 0) with λ >= 0.
        """
        rise, spread = self.along(y)
        found = _signs(rise, spread, y, side)
        middle, others, error = self.slopes
        by_terms = np.abs(np.einsum("fim,im->fm", others, y)).sum(axis=0)
        by_terms = (by_terms + np.einsum("im,im->m", np.abs(y), error)) * UP
        return found | _signs(np.einsum("im,im->m", middle, y), by_terms, y, side)

    def rises(self, side: int = 0) -> Array:
        """Return in which boxes a slope of U has one sign for all bodies by its terms alone."""
        up, down = self.plain.lo > 0, self.plain.hi < 0
        if side:
            up[1], down[1] = (up[1], False) if side > 0 else (False, down[1])
        return np.asarray(np.any(up | down, axis=0))


def _signs(rise: Array, spread: Array, y: Array, side: int) -> Array:
    if not side:
        return np.asarray(np.abs(rise) > spread)
    return np.asarray(
        ((rise > spread) & (side * y[1] >= 0)) | ((-rise > spread) & (side * y[1] <= 0))
    )


class Family:
    """The energies of all bodies in a box, with proved bounds.

    Args:
        forms: The energies.
    """

    def __init__(self, forms: Forms) -> None:
        self.forms, self.n = forms, 3 + len(forms.inner)
        self.count = len(forms.functions)
        results = [*forms.functions, *(Expr({m: ONE}) for m in forms.left.entries)]
        leaves = {v: (i,) for i, v in enumerate((*THETA, *forms.inner))}
        self.compiled = Compiled(results, self.n, leaves, 3, LEAST)
        self.points = Compiled(results, self.n, leaves, 2, LEAST)
        rows, place = exponents(self.n, 3)
        unit = np.eye(self.n, dtype=int)

        def places(a: Array) -> Array:
            flat = [place[tuple(row)] for row in a.reshape(-1, self.n).tolist()]
            return np.array(flat).reshape(a.shape[:-1])

        self.first = places(unit)
        self.second = places(unit[:, None] + unit)
        self.third = places(unit[:, None, None] + unit[:, None] + unit)
        self.order = np.array([sum(row) for row in rows])
        self.factors = np.array([float(prod(factorial(p) for p in row)) for row in rows])[:, None]
        self.size = np.abs(forms.middle) + np.abs(forms.others).sum(axis=0)
        # Coefficients are rounded, and then sums over functions, forms and axes.
        self.epsilon = (2 * self.count + 60) * ROUNDING

    # -- coefficients ---------------------------------------------------------------------------

    @property
    def batch(self) -> int:
        """How many boxes are worth bounding at once."""
        return int(min(1024, max(64, 200_000 // max(1, len(self.forms.others)))))

    def _values(
        self,
        compiled: Compiled,
        lo: Array,
        hi: Array,
        about: Values | None = None,
        reach: Array | None = None,
    ) -> tuple[Intervals, Values]:
        """Return the derivatives of all functions, shape (functions, coefficients, boxes)."""
        variables = (*THETA, *self.forms.inner)
        one = np.ones(lo.shape[1])

        def leaf(v: int) -> Intervals:
            i = variables.index(v)
            return Intervals(np.stack([lo[i], one]), np.stack([hi[i], one]))

        with np.errstate(all="ignore"):
            found = compiled(leaf, about, reach)
            dense = [found.dense(k, lo.shape[1]) for k in range(len(compiled.results))]
            factors = self.factors[: len(compiled.exponents)]
            low = np.stack([one.lo for one in dense]) * factors
            high = np.stack([one.hi for one in dense]) * factors
        return Intervals(low, high), found

    def summed(self, mid: Array, rad: Array) -> tuple[Array, Array, Array]:
        """Return Σ C_0 μ, all Σ C_j μ, and a bound on the errors of all of them."""
        forms = self.forms
        middle = np.tensordot(forms.middle, mid, 1)
        others = np.tensordot(forms.others, mid, 1)
        error = np.tensordot(self.size, rad + self.epsilon * np.abs(mid), 1)
        return middle, others, error * UP + 1e-290

    def over(self, lo: Array, hi: Array) -> "Over":
        """Return bounds over boxes from lo to hi, both of shape (3, boxes)."""
        m, inner = lo.shape[1], self.n - 3
        ends = np.ones((inner, m))
        centre = 0.5 * lo + 0.5 * hi
        middle = np.vstack([centre, 0 * ends])
        wide = np.nextafter(np.maximum(hi - centre, centre - lo), np.inf)
        radius = np.vstack([wide, ends])
        with np.errstate(all="ignore"):
            tightened = bool(self.compiled.tightened)
            c, about = self._values(self.compiled if tightened else self.points, middle, middle)
            low, high = np.vstack([lo, -ends]), np.vstack([hi, ends])
            if tightened:
                o, _ = self._values(self.compiled, low, high, about, radius)
            else:
                o, _ = self._values(self.compiled, low, high)
        return Over(self, centre, radius, c, o)

    def plain(self, o: Intervals, places: Array, remainder: Array) -> Intervals:
        """Bound derivatives of U over boxes by intervals of the coefficients of each function."""
        reach = (self.size - np.abs(self.forms.middle)) * UP
        size = np.abs(self.forms.middle) * ROUNDING + reach
        low, high = self.forms.middle - size, self.forms.middle + size
        mine = o[slice(0, self.count), places]
        shape = np.shape(mine.lo)
        ends = [np.broadcast_to(x[:, None, None], shape) for x in (low, high)]
        terms = product(Intervals(*ends), mine)
        lost = self.epsilon * np.fmax(np.abs(terms.lo), np.abs(terms.hi)).sum(axis=0)
        lost_low = np.where(np.isfinite(lost), lost, self.epsilon * np.abs(terms.lo).sum(axis=0))
        lost_high = np.where(np.isfinite(lost), lost, self.epsilon * np.abs(terms.hi).sum(axis=0))
        return Intervals(
            terms.lo.sum(axis=0) - lost_low - remainder,
            terms.hi.sum(axis=0) + lost_high + remainder,
        )

    def remainder(self, o: Intervals) -> tuple[Array, Array, Array]:
        """Bound ½ q'Rq with 0 <= R <= F'F, its gradient and Hessian by Θ over boxes."""
        left, m = self.forms.left, o.lo.shape[-1]
        if not left.left.size:
            return np.zeros(m), np.zeros((3, m)), np.zeros((3, 3, m))
        e = slice(self.count, None)
        places = np.concatenate([[0], self.first[:3], self.second[:3, :3].ravel()])
        mid, rad = o.mid[e][:, places], o.rad[e][:, places]
        found = np.abs(np.einsum("ajk,kcm->ajcm", left.left, mid)).sum(axis=0)
        found = found + np.einsum("jk,kcm->jcm", np.abs(left.left).sum(axis=0), rad)
        found = found + np.einsum("jk,kcm->jcm", left.rounding, np.abs(mid) + rad)
        norm = np.sqrt((found**2).sum(axis=0)) * UP
        N0, N1, N2 = norm[0], norm[1:4], norm[4:].reshape(3, 3, m)
        return 0.5 * N0**2 * UP, N0 * N1 * UP, (N0 * N2 + N1[:, None] * N1[None]) * UP

    def at(self, points: Array) -> tuple[Array, Array, Array]:
        """Return U, ∇U and ∇²U by Θ of the body in the middle at points (3, m), to round-off."""
        c = self._at_points(points)
        f = np.tensordot(self.forms.middle, c.mid[: self.count], 1)
        return f[0], f[self.first[:3]], f[self.second[:3, :3]]

    def gradients(self, points: Array) -> tuple[Array, Array]:
        """Return ∇U of the body in the middle at points, and how each number of the box changes it.

        Shapes (3, points) and (numbers, 3, points), to round-off.
        """
        c = self._at_points(points)
        mid = c.mid[: self.count]
        changes = np.tensordot(self.forms.linear, mid[:, self.first[:3]], 1)
        H = np.tensordot(self.forms.middle, mid, 1)[self.second[:3]]
        for k, v in enumerate(self.forms.inner):
            if v < REMAINDERS:
                changes[v - FIRST] += H[:, 3 + k]
        return np.tensordot(self.forms.middle, mid[:, self.first[:3]], 1), changes

    def disturbance(self, points: Array) -> Array:
        """Return how much each number of the box widens the bounds at some points, (numbers,)."""
        forms, mid = self.forms, self._at_points(points).mid[: self.count]
        scores = np.zeros(forms.shares.shape[1])
        for rows in (self.first[:3], self.second[:3, :3].ravel()):
            sizes = np.abs(np.tensordot(forms.others, mid[:, rows], 1))
            total = sizes.sum(axis=0)
            relative = np.nan_to_num(sizes / np.where(total > 0, total, 1.0)).sum(axis=(1, 2))
            scores += forms.shares.T @ relative
        H = np.abs(np.tensordot(forms.middle, mid, 1)[self.second[:3]]).sum(axis=(0, 2))
        for k, v in enumerate(forms.inner):
            if v < REMAINDERS and H.sum() > 0:
                scores[v - FIRST] += H[3 + k] / H[3:].sum() if H[3:].sum() > 0 else 0.0
        return scores

    def _at_points(self, points: Array) -> Intervals:
        middle = np.vstack([points, np.zeros((self.n - 3, points.shape[1]))])
        return self._values(self.points, middle, middle)[0]


class Over:
    """Bounds over boxes, each computed when it is asked for."""

    def __init__(
        self, family: Family, centre: Array, radius: Array, c: Intervals, o: Intervals
    ) -> None:
        self.family, self.centre, self.radius, self.c, self.o = family, centre, radius, c, o

    @cached_property
    def local(self) -> Local:
        """Bounds on ∇U."""
        f = self.family
        n, first = slice(0, f.count), f.first[:3]
        low = slice(0, int(np.sum(f.order <= 2)))
        f0, forms, error = f.summed(self.c.mid[n, low], self.c.rad[n, low])
        one, two = first, f.second[:3]
        with np.errstate(all="ignore"):
            remainder = f.remainder(self.o)[1]
            rest = error[one] + np.einsum("ijm,jm->im", error[two], self.radius)
            rest = (rest + np.fmin(self._by_third, self._by_second) + remainder) * UP
            over = f.summed(self.o.mid[n, first], self.o.rad[n, first])
            return Local(
                self.centre,
                self.radius,
                (f0[one], forms[:, one]),
                (f0[two], forms[:, two]),
                rest,
                (over[0], over[1], over[2] + remainder),
                f.plain(self.o, first, remainder),
            )

    @cached_property
    def third(self) -> Array:
        """Bounds on the third derivatives, the first by Θ, shape (3, n, n, boxes)."""
        f0, forms, error = self._third
        f = self.family
        rows = np.cumsum(f.order == 3) - 1
        T = (np.abs(f0) + np.abs(forms).sum(axis=0) + error) * UP
        return np.asarray(T[rows[f.third[:3]]])

    @cached_property
    def _third(self) -> tuple[Array, Array, Array]:
        n, high = slice(0, self.family.count), self.family.order == 3
        return self.family.summed(self.o.mid[n, high], self.o.rad[n, high])

    @property
    def _by_third(self) -> Array:
        r = self.radius
        return np.asarray(0.5 * np.einsum("ijkm,jm,km->im", self.third, r, r) * UP)

    @property
    def _by_second(self) -> Array:
        """Bound |(∇²U(ξ) - ∇²U(m)) δ| from the second derivatives over the boxes."""
        f, c, o = self.family, self.c, self.o
        n, places = slice(0, f.count), f.second[:3]
        away = np.maximum(o.hi[n, places] - c.lo[n, places], c.hi[n, places] - o.lo[n, places])
        found = np.tensordot(f.size, away, 1) * UP
        return np.asarray(np.einsum("ijm,jm->im", found, self.radius) * UP)

    @property
    def curvature(self) -> tuple[Array, Array, Array]:
        """∇²U by Θ of all bodies at the first centre: H_0, all H_j, and a bound on the rest.

        That a number inside of functions changes is one more H_j: half of its range times ∂∇²U.
        """
        f = self.family
        n, places = slice(0, f.count), f.second[:3, :3]
        middle, others, error = (
            x[..., 0] for x in f.summed(self.c.mid[n, places], self.c.rad[n, places])
        )
        t0, t, wrong = self._third
        rows = np.cumsum(f.order == 3) - 1
        inner = np.moveaxis(rows[f.third[:3, :3, 3:]], 2, 0)
        error = error + (np.abs(t[:, inner, 0]).sum(axis=(0, 1)) + wrong[inner, 0].sum(axis=0)) * UP
        return middle, np.concatenate([others, t0[inner, 0]]), error

    @property
    def change(self) -> Array:
        """Bounds on how ∇²U changes with Θ within the boxes, and on the remainder's Hessian."""
        moved = np.einsum("ijkm,km->ijm", self.third[:, :3, :3], self.radius[:3])
        return np.asarray((moved + self.family.remainder(self.o)[2]) * UP)

    # -- values ---------------------------------------------------------------------------------

    @cached_property
    def expansion(self) -> "Expansion":
        """U of all bodies up to second order."""
        f = self.family
        n, rows = slice(0, f.count), np.concatenate([[0], f.first])
        f0, forms, error = f.summed(self.c.mid[n, rows], self.c.rad[n, rows])
        with np.errstate(all="ignore"):
            s0, s, wrong = f.summed(self.o.mid[n][:, f.second], self.o.rad[n][:, f.second])
            sizes = (np.abs(s0) + np.abs(s).sum(axis=0) + wrong) * UP
            bend = 0.5 * np.einsum("ijm,im,jm->m", sizes, self.radius, self.radius) * UP
        lost = error[0] + np.einsum("im,im->m", error[1:], self.radius)
        return Expansion(
            (f0[0], f0[1:]), (forms[:, 0], forms[:, 1:]), lost, bend, f.remainder(self.o)[0]
        )

    @cached_property
    def values(self) -> tuple[Array, Array, Array]:
        """U over the boxes from its terms: of f_0, of all forms, and their errors."""
        n = slice(0, self.family.count)
        with np.errstate(all="ignore"):
            return self.family.summed(self.o.mid[n, 0], self.o.rad[n, 0])

    @cached_property
    def plain_value(self) -> Intervals:
        """U over the boxes, with infinite ends where it has a pole."""
        with np.errstate(all="ignore"):
            value, _, _ = self.family.remainder(self.o)
            found = self.family.plain(self.o, np.array([0]), value[None])
        return found[0]


@dataclass(frozen=True, eq=False)
class Expansion:
    """U of all bodies over boxes: v_0 + g_0 δ + Σ w_j (v_j + g_j δ) up to a bend, with δ as above.

    Args:
        middle: v_0 and g_0, shapes (boxes,) and (n, boxes).
        others: v_j and g_j, shapes (forms, boxes) and (forms, n, boxes).
        error: A bound on the rounding, shape (boxes,).
        bend: A bound on ½ δ'∂²U δ, shape (boxes,).
        remainder: A bound on ½ q'Rq over the boxes, which lowers U, shape (boxes,).
    """

    middle: tuple[Array, Array]
    others: tuple[Array, Array]
    error: Array
    bend: Array
    remainder: Array
