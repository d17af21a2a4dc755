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
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.compiled import Compiled, derivatives
from rbstab.proof.enclosures.intervals import SIGNS, Intervals, outward
from rbstab.proof.enclosures.taylor import Values, unit_slopes
from rbstab.proof.exact.atoms import Atom
from rbstab.proof.exact.expr import Expr

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
        spread = times(np.abs(S) + s, self.radius) * UP
        by_mean, natural = self.gradient.widened(spread, spread), self.gradient_over
        return Intervals(np.fmax(natural.lo, by_mean.lo), np.fmin(natural.hi, by_mean.hi))


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
        self.theta, self.z = slice(0, self.n), slice(self.n, None)
        total = self.n + self.k
        leaves: dict[int, Sequence[int]] = {v: (i,) for i, v in enumerate(self.variables)}
        leaves |= {v: (*range(self.n), self.n + j) for j, v in enumerate(self.free)}
        self.points = Compiled([U], total, leaves, 2, self.least)
        self.boxes = Compiled([U, *also], total, leaves, order, self.least)
        self.first, self.second, self.third, _ = derivatives(total, order)

    # -- coefficients --------------------------------------------------------------------------

    def _values(  # noqa: PLR0913, PLR0917 (what it is computed from, where it is needed)
        self,
        compiled: Compiled,
        x: Array,
        z: Array,
        C: Array,
        about: Values | None = None,
        reach: Array | None = None,
    ) -> Values:
        """Return values where Θ is x, (n, 2 or 1, boxes), and z with the slopes C, likewise."""
        given = unit_slopes(self.variables, x)
        for v, value, slopes in zip(self.free, z, C, strict=True):
            by_theta = np.broadcast_to(slopes[:, None], x.shape)
            given[v] = np.concatenate([value[None], by_theta, np.ones_like(x[:1])])
        return Values(compiled, given, about, reach)

    def _at(self, centre: Array, least: Minimiser) -> tuple[Intervals, Values | None]:
        """Return the derivatives at points, and all values there if bounds over boxes use them."""
        compiled = self.boxes if self.boxes.tightened else self.points
        x, z = (np.stack([point, point], 1) for point in (centre, least.z))
        values = self._values(compiled, x, outward(z), least.C)
        return Intervals.of(values.derivatives(0)), values if self.boxes.tightened else None

    @cached_property
    def _by_free(self) -> Compiled:
        """U for derivatives by z alone, which are far fewer."""
        alone = {v: (j,) for j, v in enumerate(self.free)}
        return Compiled([self.U], self.k, alone, 2, self.least)

    def minimiser(self, points: Array) -> Minimiser:
        """Return z near the lowest point at some points of shape (n, points), to round-off."""
        b, z = self.z, np.zeros((self.k, points.shape[1]))
        if not self.k:
            return Minimiser(z, np.zeros((0, *points.shape)), z[:, None])
        fixed = dict(zip(self.variables, points[:, None, None], strict=True))
        places = derivatives(self.k, 2)
        with np.errstate(all="ignore"):
            for _ in range(NEWTON_STEPS):
                moved = fixed | unit_slopes(self.free, z[:, None])
                f = Values(self._by_free, moved).derivatives(0)[:, 0]
                step = times(inverses(f[places.second]), f[places.first])
                step = np.where(np.isfinite(step), step, 0.0)
                z = z - np.clip(step, -0.5, 0.5)
                if np.abs(step).max(initial=0.0) < NEAR * (1 + np.abs(z).max(initial=0.0)):
                    break
            _, _, H = self.at_all(points, z)
            inverse = inverses(H[b, b])
            return Minimiser(z, -times(inverse, H[b, self.theta]), inverse)

    def at_all(self, points: Array, z: Array) -> tuple[Array, Array, Array]:
        """Return U, ∇U and ∇²U by Θ and z at points (n, points) and z (free, points)."""
        fixed = np.zeros((self.k, self.n, 1))
        f = self._values(self.points, points[:, None], z[:, None], fixed).derivatives(0)[:, 0]
        return f[0], f[self.first], f[self.second]

    # -- bounds --------------------------------------------------------------------------------

    def over(self, lo: Array, hi: Array) -> Bounds:
        """Return bounds over the boxes lo <= Θ <= hi, both of shape (n, boxes)."""
        centre = 0.5 * lo + 0.5 * hi
        radius = np.nextafter(np.maximum(hi - centre, centre - lo), np.inf)
        x = np.stack([lo, hi], 1)
        with np.errstate(all="ignore"):
            return self._over(x, centre, radius)

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

    def is_single(self, x: Array, values: Values, size: Array) -> Array:
        """Return whether U has one stationary point z, its minimiser, for all Θ of each box.

        Args:
            x: The ends of the boxes, shape (n, 2, boxes).
            values: The values of U and of `also` over each box, with the z that belong to it.
            size: The largest |z_i| of these, shape (free, boxes).
        """
        return np.ones(x.shape[2], dtype=bool)  # as it is convex in z

    def _over(self, x: Array, centre: Array, radius: Array) -> Bounds:
        a, b = self.theta, self.z
        least = self.minimiser(centre)
        at, about = self._at(centre, least)
        way = times(np.abs(least.C), radius)
        nothing = np.zeros_like(least.z)

        def box(Z: Array) -> tuple[Values, Intervals]:
            z = outward(least.z[:, None] + SIGNS * (way * UP + Z)[:, None])
            reach = np.concatenate([radius, Z])
            values = self._values(self.boxes, x, z, least.C, about, reach)
            return values, Intervals.of(values.derivatives(0))

        values, over = box(nothing)
        if not self.k:
            return self._bounds(centre, radius, at, over, radius)
        # ζ at the centre: |ζ| <= 2|Y g_ζ|, which Krawczyk's test for the box below includes.
        g, magnitude = at[self.first], np.abs(least.inverse)
        at_zero = 2 * times(magnitude, g.mag[b]) * UP + 1e-18
        drift = self._slopes_along(at, over, radius)
        Z = 2 * times(magnitude, drift) * UP + 2 * at_zero
        values, over = box(Z)
        H = over[self.second][b, b]
        E = _residual(least.inverse, Matrices(H.mid, H.rad))
        image = times(magnitude, self._slopes_along(at, over, radius))
        image = image + times(E, Z)
        norm = E.sum(axis=1).max(axis=0) * UP
        inside = np.all(image * UP < Z, axis=0) & (norm < 1)
        inside &= self.is_single(x, values, (np.abs(least.z) + way + Z) * UP)
        # |U_ζζ⁻¹| <= Σ Eᵏ|Y|; entries of Eᵏ are at most |E|ᵏ⁻¹ times the largest in their column.
        share = E + E.max(axis=0) * (norm / np.maximum(1 - norm, 1e-300)) * UP
        inverse = times(np.eye(self.k)[..., None] + share, magnitude) * UP
        whole = self._bounds(centre, radius, at, over, np.concatenate([radius, Z]))
        cross = np.abs(whole.hessian.mid[a, b]) + whole.hessian.rad[a, b]
        schur = np.einsum("ijm,jkm,lkm->ilm", cross, inverse, cross) * UP
        unknown = np.where(inside, 0.0, np.inf)
        hessian, slope = (
            Matrices(M.mid[a, a], M.rad[a, a] + schur + unknown)
            for M in (whole.hessian, whole.slope)
        )
        fall = (g.mag[b] * at_zero).sum(axis=0) * UP + unknown
        # Over the way from ẑ to the minimiser the mixed derivatives are those of the box.
        mixed = np.maximum(at.mag[self.second][a, b], cross)
        off = times(mixed, at_zero) * UP + unknown
        return Bounds(
            centre,
            radius,
            whole.value.widened(fall, 0.0),
            g[a].widened(off, off),
            whole.gradient_over[a].widened(unknown, unknown),
            slope,
            hessian,
            whole.value_over.widened(unknown, unknown),
        )

    def _slopes_along(self, at: Intervals, over: Intervals, radius: Array) -> Array:
        """Bound |U_ζ(δ, 0)| over the boxes: at the centre, plus U_ζδ δ, plus ½ U_ζδδ δδ."""
        a, b = self.theta, self.z
        wide = over.mag[self.second][b, a]
        centre = at.mag[self.first][b]
        slope = centre + times(wide, radius)
        if self.order >= 3:
            T = over.mag[self.third][b, a, a]
            by_third = centre + times(at.mag[self.second][b, a], radius)
            by_third = by_third + 0.5 * np.einsum("ijkm,jm,km->im", T, radius, radius)
            slope = np.fmin(slope, by_third)
        return np.asarray(slope * UP)

    def at(self, points: Array) -> tuple[Array, Array, Array]:
        """Return V, ∇V and ∇²V at points of shape (n, points), to round-off."""
        a, b, least = self.theta, self.z, self.minimiser(points)
        value, gradient, H = self.at_all(points, least.z)
        return value, gradient[a], H[a, a] + times(H[a, b], least.C)

    def curvatures(self, x: Array) -> Array:
        """Return the eigenvalues of ∇²V at one point of shape (n,), to round-off."""
        eigenvalues: Array = np.linalg.eigvalsh(self.at(x[:, None])[2][:, :, 0])
        return eigenvalues


def times(M: Array, x: Array) -> Array:
    """Return Mx for each box, with matrices of shape (n, k, boxes), and vectors or matrices x."""
    return np.asarray(np.einsum("ijm,jm->im" if x.ndim == 2 else "ijm,jkm->ikm", M, x))


def inverses(M: Array) -> Array:
    """Return approximate inverses of matrices of shape (n, n, boxes); NaN for a singular one."""
    stacked = np.moveaxis(M, 2, 0)
    with np.errstate(all="ignore"):
        size = np.linalg.det(stacked)[:, None, None]
        good = np.isfinite(size) & (size != 0)
        inverse = np.linalg.inv(np.where(good, stacked, np.eye(len(M))))
    return np.moveaxis(np.where(good, inverse, np.nan), 0, 2)


def _residual(Y: Array, M: Matrices) -> Array:
    """Bound |I - YM| for each matrix M, shape (n, n, boxes)."""
    eye = np.eye(len(Y))[..., None]
    near = np.abs(eye - times(Y, M.mid))
    size = times(np.abs(Y), M.rad + ROUND_OFF * np.abs(M.mid))
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
    step = times(Y, g.mid)
    size = g.rad + ROUND_OFF * np.abs(g.mid)
    error = times(np.abs(Y), size) * UP
    return step, error, _residual(Y, b.slope), _residual(Y, b.hessian)
