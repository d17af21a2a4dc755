"""Proved bounds on V(Θ) = min over z of U(Θ, z), its gradient and its Hessian, over many boxes.

With the centre m of a box, z = ẑ + C(Θ - m) + ζ, where ẑ is near the minimiser at m, and C near its
derivative. Taylor coefficients in (δ, ζ), δ = Θ - m, are then small where they should be, and

    V(m) = U(m, ẑ) - [0, |g_ζ| |ζ|]    ∇V = U_δ    ∇²V = U_δδ - U_δζ U_ζζ⁻¹ U_ζδ    at ζ*(δ).

Krawczyk's test for U_ζ = 0 shows that ζ*(δ) is in a box Z for all δ. U is convex in z, or
`is_single` shows this over each box, so it is the only minimiser. Without free variables this is
Taylor's theorem alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.compiled import Compiled, derivatives
from rbstab.proof.enclosures.intervals import Intervals, met, outward
from rbstab.proof.enclosures.points import AtPoints, Point
from rbstab.proof.enclosures.taylor import Values, variables_over
from rbstab.proof.exact.expr import Atom, Expr

UP = 1 + 1e-12
"""Covers the round-off of a sum of some magnitudes."""

ROUND_OFF = 1e-14
"""That of the entries of a product of two small matrices, relative to the sum of its terms."""


NEWTON_STEPS = 60

NEAR = 1e-8
"""Relative size of the last Newton step: the next would be round-off. What is left of it counts in
the bounds."""


class Matrices(NamedTuple):
    """Matrices known to an error, for each box: middles and radii, shape (n, n, boxes)."""

    mid: Array
    rad: Array


@dataclass(frozen=True, eq=False)
class Bounds:
    """V and its derivatives over boxes, with proved errors.

    Args:
        centre: The centres of the boxes, shape (n, boxes).
        radius: Radii about them that reach the ends, shape (n, boxes).
        value: V at the centres, J.
        gradient: ∇V at the centres, shape (n, boxes).
        gradient_over: ∇V over the boxes, from its terms.
        slope: S with ∇V(x) = ∇V(m) + S(x - m) for each x of the box.
        hessian: ∇²V over the boxes.
        value_over: V over the boxes, from its terms, J.
    """

    centre: Array
    radius: Array
    value: Intervals
    gradient: Intervals
    gradient_over: Intervals
    slope: Matrices
    hessian: Matrices
    value_over: Intervals

    @property
    def slopes(self) -> Intervals:
        """∇V over the boxes, from its terms and from the mean value theorem."""
        S, s = self.slope
        spread = np.einsum("ijm,jm->im", np.abs(S) + s, self.radius) * UP
        by_mean = outward(self.gradient.lo - spread, self.gradient.hi + spread)
        return met(self.gradient_over, by_mean)


class Minimiser(NamedTuple):
    """Where U is least over z, near the centres of boxes, and how that moves.

    Attributes:
        z: ẑ, shape (free, boxes).
        C: Near dẑ/dΘ, shape (free, n, boxes).
        inverse: Near U_ζζ⁻¹, shape (free, free, boxes).
    """

    z: Array
    C: Array
    inverse: Array


class BoundedEnergy:
    """V over boxes of Θ, and of other variables if there are some.

    Args:
        U: The energy.
        variables: The numbers of the variables of the boxes.
        free: Those over which it is minimised.
        least: Known lower bounds of atoms, such as 0 of cos θ2.
        order: 3, or 2 for bounds without third derivatives.
        also: Expressions whose values `is_single` needs.
    """

    def __init__(  # noqa: PLR0913, PLR0917 (each is one fact about V)
        self,
        U: Expr,
        variables: Sequence[int] = (0, 1, 2),
        free: Sequence[int] = (),
        least: Mapping[Atom, float] | None = None,
        order: int = 3,
        also: Sequence[Expr] = (),
    ) -> None:
        self.U, self.variables, self.free = U, tuple(variables), tuple(free)
        self.least, self.order = least or {}, order
        self.n, self.k = len(self.variables), len(self.free)
        total = self.n + self.k
        leaves = {v: (i,) for i, v in enumerate(self.variables)}
        moving = {v: (*range(self.n), self.n + j) for j, v in enumerate(self.free)}
        leaves_of_all: dict[int, Sequence[int]] = {**leaves, **moving}
        self.points = Compiled([U], total, leaves_of_all, 2, self.least)
        self.boxes = Compiled([U, *also], total, leaves_of_all, order, self.least, self.free)
        with_z = {m: c for m, c in U.terms.items() if any(a.variables & set(free) for a, _ in m)}
        alone = {v: (j,) for j, v in enumerate(self.free)}
        self.of_free = Compiled([Expr(with_z)], self.k, alone, 2, self.least, self.free)
        self.evaluated = 0
        self.first, self.second, self.third, _ = derivatives(total, order)

    # -- coefficients --------------------------------------------------------------------------

    def _values(  # noqa: PLR0913, PLR0917 (what it is computed from, where it is needed)
        self,
        compiled: Compiled,
        lo: Array,
        hi: Array,
        least: Minimiser | None = None,
        Z: Array | None = None,
        about: Values | None = None,
        reach: Array | None = None,
        known: Values | None = None,
    ) -> Values:
        self.evaluated += lo.shape[1]
        centre = 0.5 * lo + 0.5 * hi
        wide = np.maximum(hi - centre, centre - lo)
        one, angles = np.ones(lo.shape[1]), variables_over(self.variables, lo, hi)

        def leaf(v: int) -> Intervals:
            if v in self.variables:
                return angles(v)
            j = self.free.index(v)
            assert least is not None
            assert Z is not None
            spread = (np.abs(least.C[j]) * wide).sum(axis=0) * UP + Z[j]
            whole = outward((least.z[j] - spread)[None], (least.z[j] + spread)[None])
            slopes = np.stack([*least.C[j], one])
            return Intervals(np.concatenate([whole.lo, slopes]), np.concatenate([whole.hi, slopes]))

        return Values(compiled, leaf, about, reach, known)

    def _at(
        self, centre: Array, least: Minimiser | None = None, Z: Array | None = None
    ) -> tuple[Intervals, Values | None]:
        """Return the derivatives at points, and all values there if bounds over boxes use them."""
        compiled = self.boxes if self.boxes.tightened else self.points
        values = self._values(compiled, centre, centre, least, Z)
        return values.derivatives(0, centre.shape[1]), values if self.boxes.tightened else None

    def minimiser(self, points: Array) -> Minimiser:
        """Return z near the lowest point at some points of shape (n, points), to round-off."""
        count = points.shape[1]
        z = np.zeros((self.k, count))
        with np.errstate(all="ignore"):
            known = None
            for _ in range(NEWTON_STEPS):
                known = AtPoints(self.of_free, self._at_points(points, z, 0), known)
                f, places = known.derivatives(0, count), derivatives(self.k, 2)
                step = np.einsum("ijm,jm->im", inverses(f[places.second]), f[places.first])
                step = np.where(np.isfinite(step), step, 0.0)
                z = z - np.clip(step, -0.5, 0.5)
                if np.abs(step).max(initial=0.0) < NEAR * (1 + np.abs(z).max(initial=0.0)):
                    break
        a, b = slice(0, self.n), slice(self.n, None)
        _, _, H = self.at_all(points, z)
        inverse = inverses(H[b, b])
        return Minimiser(z, -np.einsum("ijm,jkm->ikm", inverse, H[b, a]), inverse)

    def _at_points(self, points: Array, z: Array, slopes: int) -> Point:
        """Return the variables at points: Θ with so many slopes (0: it is fixed), and z."""
        one, none = np.ones(points.shape[1]), [np.zeros(points.shape[1])] * (slopes * self.n)

        def point(v: int) -> Array:
            if v in self.variables:
                return np.stack([points[self.variables.index(v)], *[one] * slopes])
            return np.stack([z[self.free.index(v)], *none, one])

        return point

    def at_all(self, points: Array, z: Array) -> tuple[Array, Array, Array]:
        """Return U, ∇U and ∇²U by Θ and z at points (n, points) and z (free, points)."""
        with np.errstate(all="ignore"):
            at = AtPoints(self.points, self._at_points(points, z, 1))
            f = at.derivatives(0, points.shape[1])
        return f[0], f[self.first], f[self.second]

    # -- bounds --------------------------------------------------------------------------------

    def over(self, lo: Array, hi: Array) -> Bounds:
        """Return bounds over the boxes lo <= Θ <= hi, both of shape (n, boxes)."""
        centre = 0.5 * lo + 0.5 * hi
        radius = np.nextafter(np.maximum(hi - centre, centre - lo), np.inf)
        with np.errstate(all="ignore"):
            if self.k:
                return self._reduced(lo, hi, centre, radius)
            at, about = self._at(centre)
            values = self._values(self.boxes, lo, hi, about=about, reach=radius)
            return self._bounds(centre, radius, at, values.derivatives(0, lo.shape[1]), radius)

    def _bounds(
        self, centre: Array, radius: Array, at: Intervals, over: Intervals, reach: Array
    ) -> Bounds:
        """Return bounds on U and its derivatives by all variables."""
        H, at_centre = over[self.second], at[self.second]
        hessian, slope = Matrices(H.mid, H.rad), Matrices(H.mid, H.rad)
        if self.order >= 3:
            T = over.mag[self.third]
            wide = np.einsum("ijkm,km->ijm", T, reach) * UP
            # Along the way from the centre, third derivatives by Θ count half in the mean.
            half = (wide - 0.5 * np.einsum("ijkm,km->ijm", T[:, :, : self.n], radius)) * UP
            hessian = _sharper(hessian, at_centre, wide)
            slope = _sharper(slope, at_centre, half)
        return Bounds(
            centre, radius, at[0], at[self.first], over[self.first], slope, hessian, over[0]
        )

    def is_single(self, lo: Array, hi: Array, values: Values, size: Array) -> Array:
        """Return whether U has one stationary point z, its minimiser, for all Θ of each box.

        Args:
            lo: The lower ends of the boxes, shape (n, boxes).
            hi: The upper ends.
            values: The values of U and of `also` over each box, with the z that belong to it.
            size: The largest |z_i| of these, shape (free, boxes).
        """
        return np.ones(lo.shape[1], dtype=bool)  # as it is convex in z

    def _reduced(self, lo: Array, hi: Array, centre: Array, radius: Array) -> Bounds:
        """Return bounds on the least energy over z."""
        least = self.minimiser(centre)
        nothing = np.zeros_like(least.z)
        at, about = self._at(centre, least, nothing)
        a, b = slice(0, self.n), slice(self.n, None)
        magnitude = np.abs(least.inverse)

        def box(Z: Array, known: Values | None = None) -> Values:
            reach = np.concatenate([radius, Z])
            return self._values(self.boxes, lo, hi, least, Z, about, reach, known)

        # ζ at the centre: |ζ| <= 2|Y g_ζ|, which Krawczyk's test for the box below includes.
        g = at[self.first]
        at_zero = 2 * np.einsum("ijm,jm->im", magnitude, g.mag[b]) * UP + 1e-18
        count, first = lo.shape[1], box(nothing)
        drift = self._slopes_along(at, first.derivatives(0, count), radius)
        Z = 2 * np.einsum("ijm,jm->im", magnitude, drift) * UP + 2 * at_zero
        values = box(Z, first)
        over = values.derivatives(0, count)
        H = over[self.second]
        E = _residual(least.inverse, Matrices(H.mid[b, b], H.rad[b, b]))
        image = np.einsum("ijm,jm->im", magnitude, self._slopes_along(at, over, radius))
        image = image + np.einsum("ijm,jm->im", E, Z)
        norm = E.sum(axis=1).max(axis=0) * UP
        inside = np.all(image * UP < Z, axis=0) & (norm < 1)
        size = np.abs(least.z) + np.einsum("ijm,jm->im", np.abs(least.C), radius) + Z
        inside &= self.is_single(lo, hi, values, size * UP)
        # |U_ζζ⁻¹| <= Σ Eᵏ|Y|; entries of Eᵏ are at most |E|ᵏ⁻¹ times the largest in their column.
        share = E + E.max(axis=0) * (norm / np.maximum(1 - norm, 1e-300)) * UP
        bound = np.einsum("ijm,jkm->ikm", np.eye(self.k)[..., None] + share, magnitude) * UP
        whole = self._bounds(centre, radius, at, over, np.concatenate([radius, Z]))
        return self._without_free(whole, at, at_zero, bound, inside, (a, b))

    def _without_free(  # noqa: PLR0913, PLR0917 (what `_reduced` has computed)
        self,
        whole: Bounds,
        at: Intervals,
        at_zero: Array,
        inverse: Array,
        inside: Array,
        blocks: tuple[slice, slice],
    ) -> Bounds:
        a, b = blocks
        cross = np.abs(whole.hessian.mid[a, b]) + whole.hessian.rad[a, b]
        schur = np.einsum("ijm,jkm,lkm->ilm", cross, inverse, cross) * UP
        unknown = np.where(inside, 0.0, np.inf)
        hessian, slope = (
            Matrices(M.mid[a, a], M.rad[a, a] + schur + unknown)
            for M in (whole.hessian, whole.slope)
        )
        g = whole.gradient
        fall = (g.mag[b] * at_zero).sum(axis=0) * UP + unknown
        off = np.einsum("ijm,jm->im", at.mag[self.second][a, b], at_zero) * UP + unknown
        # Over the way from ẑ to the minimiser the mixed derivatives are those of the box.
        off = np.maximum(off, np.einsum("ijm,jm->im", cross, at_zero) * UP)
        natural = whole.gradient_over
        return Bounds(
            whole.centre,
            whole.radius,
            outward(whole.value.lo - fall, whole.value.hi),
            outward(g.lo[a] - off, g.hi[a] + off),
            Intervals(natural.lo[a] - unknown, natural.hi[a] + unknown),
            slope,
            hessian,
            Intervals(whole.value_over.lo - unknown, whole.value_over.hi + unknown),
        )

    def _slopes_along(self, at: Intervals, over: Intervals, radius: Array) -> Array:
        """Bound |U_ζ(δ, 0)| over the boxes: at the centre, plus U_ζδ δ, plus ½ U_ζδδ δδ."""
        a, b = slice(0, self.n), slice(self.n, None)
        wide = over.mag[self.second][b, a]
        centre = at.mag[self.first][b]
        found = centre + np.einsum("ijm,jm->im", wide, radius)
        if self.order >= 3:
            T = over.mag[self.third][b, a, a]
            by_third = centre + np.einsum("ijm,jm->im", at.mag[self.second][b, a], radius)
            by_third = by_third + 0.5 * np.einsum("ijkm,jm,km->im", T, radius, radius)
            found = np.fmin(found, by_third)
        return np.asarray(found * UP)

    def at(self, points: Array) -> tuple[Array, Array, Array]:
        """Return V, ∇V and ∇²V at points of shape (n, points), to round-off."""
        a, b = slice(0, self.n), slice(self.n, None)
        if not self.k:
            return self.at_all(points, np.zeros((0, points.shape[1])))
        least = self.minimiser(points)
        value, gradient, H = self.at_all(points, least.z)
        return value, gradient[a], H[a, a] + np.einsum("ijm,jkm->ikm", H[a, b], least.C)

    def curvatures(self, x: Array) -> Array:
        """Return the eigenvalues of ∇²V at one point of shape (n,), to round-off."""
        found: Array = np.linalg.eigvalsh(self.at(x[:, None])[2][:, :, 0])
        return found


def inverses(M: Array) -> Array:
    """Return approximate inverses of matrices of shape (n, n, boxes); NaN for a singular one."""
    stacked = np.moveaxis(M, 2, 0)
    with np.errstate(all="ignore"):
        try:
            return np.moveaxis(np.linalg.inv(stacked), 0, 2)
        except np.linalg.LinAlgError:
            found = np.full(stacked.shape, np.nan)
            for k, one in enumerate(stacked):
                try:
                    found[k] = np.linalg.inv(one)
                except np.linalg.LinAlgError:
                    continue
            return np.moveaxis(found, 0, 2)


def _residual(Y: Array, M: Matrices) -> Array:
    """Bound |I - YM| for each matrix M, shape (n, n, boxes)."""
    eye = np.eye(len(Y))[..., None]
    near = np.abs(eye - np.einsum("ijm,jkm->ikm", Y, M.mid))
    size = np.einsum("ijm,jkm->ikm", np.abs(Y), M.rad + ROUND_OFF * np.abs(M.mid))
    return np.asarray((near + size) * UP + ROUND_OFF * eye)


def _sharper(natural: Matrices, at: Intervals, spread: Array) -> Matrices:
    """Return the matrices at the centres with a spread, where these are known better."""
    radius = at.rad + spread * UP
    better = radius < natural.rad
    return Matrices(np.where(better, at.mid, natural.mid), np.where(better, radius, natural.rad))


def preconditioned(b: Bounds) -> tuple[Array, Array, Array, Array]:
    """Return Y∇V = step + (I - R)δ over boxes, with an approximate inverse Y of the mean slopes.

    Returns:
        The step Y∇V(m), shape (n, boxes); its error; bounds on R = |I - YS|, shape (n, n, boxes);
        and the same for ∇²V in place of S.
    """
    Y = inverses(b.slope.mid)
    g = b.gradient
    step = np.einsum("ijm,jm->im", Y, g.mid)
    size = g.rad + ROUND_OFF * np.abs(g.mid)
    error = np.einsum("ijm,jm->im", np.abs(Y), size) * UP
    return step, error, _residual(Y, b.slope), _residual(Y, b.hessian)
