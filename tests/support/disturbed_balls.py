"""A second proof of a bound on disturbances of a held body: formulas and arithmetic of its own.

V and V' are written out by hand. Boxes, covers and Taylor series in balls are those of the checker
of stored proofs, which shares nothing with the engine.
"""

from itertools import product
from typing import Any

import numpy as np
from flint import arb, ctx

from rbstab.proof.check.cover import cover
from rbstab.proof.check.taylor import constant, derivative, leaf, summed, through, times

UNITY = arb(1)


class S:
    """A Taylor series in the three angles."""

    def __init__(self, series, order=2):
        self.series, self.order = series, order

    def _of(self, other):
        return other if isinstance(other, S) else S({(): arb(other)}, self.order)

    def __add__(self, other):
        return S(summed([(UNITY, self.series), (UNITY, self._of(other).series)]), self.order)

    def __mul__(self, other):
        if not isinstance(other, S):
            return S({k: v * arb(other) for k, v in self.series.items()}, self.order)
        return S(times(self.series, other.series, self.order), self.order)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self):
        return self * -1

    def __sub__(self, other):
        return self + -self._of(other)

    def __rsub__(self, other):
        return -self + other

    def through(self, g):
        return S(through(g, self.series, self.order), self.order)

    def inverse(self):
        v = constant(self.series)
        return self.through([1 / v, -1 / v**2, 1 / v**3])

    def sin_cos(self):
        s, c = constant(self.series).sin_cos()
        return self.through([s, c, -s / 2]), self.through([c, -s, -c / 2])


def cross_matrix(a):
    x, y, z = a
    return np.array([[0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x]], dtype=object)


def symmetric(M):
    return (M + M.T) * 0.5


def forms(held, cross, Theta):
    """Return the matrices of V over (1, Ω) and of V' over (1, Ω, w), and the trace of A."""
    (s1, c1), (s2, c2), (s3, c3) = (angle.sin_cos() for angle in Theta)
    o = 0 * s1
    first = np.array([[o + 1, o, o], [o, c1, -s1], [o, s1, c1]])
    second = np.array([[c2, o, s2], [o, o + 1, o], [-s2, o, c2]])
    third = np.array([[c3, -s3, o], [s3, c3, o], [o, o, o + 1]])
    A = first @ second @ third
    C = np.array([[c2 * c3, s3, o], [-c2 * s3, c3, o], [s2, o, o + 1]])  # Ω = C Θ̇
    by_two = np.array([[-s2 * c3, o, o], [s2 * s3, o, o], [c2, o, o]])
    by_three = np.array([[-c2 * s3, c3, o], [-c2 * c3, -s3, o], [o, o, o]])
    q, a = np.array(Theta, dtype=object), c2.inverse()
    B = np.array([[c3 * a, -s3 * a, o], [s3, c3, o], [-s2 * c3 * a, s2 * s3 * a, o + 1]])
    p, J, R = C @ q, held.J, cross_matrix(held.R)
    slopes = C + np.array([0 * p, by_two @ q, by_three @ q]).T
    X = held.R - A @ held.R
    lever = A @ R  # dX/dt = lever Ω
    damped = held.L_r + lever.T @ (held.L_t @ lever)
    pull = q @ (held.K_r @ q) + (lever @ p) @ (held.K_t @ X)
    V, W = np.full((4, 4), o, dtype=object), np.full((7, 7), o, dtype=object)
    V[0, 0] = 0.5 * (q @ (held.K_r @ q) + X @ (held.K_t @ X))
    V[0, 1:] = V[1:, 0] = 0.5 * cross * (J @ p)
    V[1:, 1:] = V[1:, 1:] + 0.5 * J
    W[0, 0] = -cross * pull
    W[0, 1:4] = W[1:4, 0] = -0.5 * cross * (damped @ p)
    turning = symmetric((slopes @ B).T @ J) - symmetric(J @ cross_matrix(p))
    W[1:4, 1:4] = -damped + cross * turning
    W[0, 4:] = W[4:, 0] = 0.5 * cross * p
    W[1:4, 4:] = W[4:, 1:4] = W[4:, 1:4] + 0.5 * np.eye(3)
    return V, W, A.trace()


def definite(at, over, radii):
    """Return whether symmetric matrices of series are positive definite over a box."""
    n = len(at)
    mid = np.array([[float(constant(x.series).mid()) for x in row] for row in at])
    way = [arb(0, r) for r in radii]
    error = np.zeros((n, n))
    slopes = np.zeros((3, n, n))
    for i, j in product(range(n), repeat=2):
        first, second = at[i, j].series, over[i, j].series
        rest = constant(first) - mid[i, j]
        for k, m in product(range(3), repeat=2):
            rest += derivative(second, k, m) * way[k] * way[m] / 2
        error[i, j] = float(abs(rest).upper()) * (1 + 1e-12)
        for k in range(3):
            exact = derivative(first, k) * radii[k]
            slopes[k, i, j] = float(exact.mid())
            error[i, j] += float(abs(exact - slopes[k, i, j]).upper()) * (1 + 1e-12)
    try:
        with np.errstate(invalid="ignore"):
            root = np.sqrt(np.diag(np.linalg.inv(mid)))
    except np.linalg.LinAlgError:
        return False
    if not (np.isfinite(error).all() and np.isfinite(root).all()):
        return False
    lost = (error * root / root[:, None]).sum(axis=1) * (1 + 1e-12)
    return all(
        _pivots(mid + np.tensordot(corner, slopes, 1), lost)
        for corner in product((-1.0, 1.0), repeat=3)
    )


def _pivots(M, lost):
    """Return whether all pivots of M - diag(lost) are positive, in balls."""
    n = len(M)
    L: Any = [[arb(x) for x in row] for row in M.tolist()]
    for k in range(n):
        # The sums of doubles at a corner are rounded.
        L[k][k] -= arb(float(lost[k])) + arb(1e-13 * float(np.abs(M[k]).sum()))
    for k in range(n):
        if not L[k][k] > 0:
            return False
        for i in range(k + 1, n):
            factor = L[i][k] / L[k][k]
            for j in range(k + 1, i + 1):
                L[i][j] -= factor * L[j][k]
                L[j][i] = L[i][j]
    return True


def proves(held, claim, limit=20_000):
    """Return whether a claim on a couple is proved, and the number of boxes."""
    cross, rate, level, tilt = map(float, (claim.cross, claim.rate, claim.level, claim.tilt))
    (size,), (weight,) = map(float, claim.sizes), map(float, claim.weights)

    def matrices(Theta):
        V, W, trace = forms(held, cross, Theta)
        above, falling = V.copy(), -W
        falling[:4, :4] = falling[:4, :4] - rate * V
        above[0, 0] = above[0, 0] - level
        falling[0, 0] = falling[0, 0] + (rate * level - weight * size * size)
        for k in range(4, 7):
            falling[k, k] = falling[k, k] + weight
        return above, falling, trace - 1 - 2 * arb(tilt).cos()

    def reason(box):
        radii = [0.5 * (b - a) * (1 + 1e-15) for a, b in box]
        middle = [S(leaf(k, arb(0.5 * (a + b))), 1) for k, (a, b) in enumerate(box)]
        whole = [S(leaf(k, arb(0.5 * (a + b), r))) for k, ((a, b), r) in _with(box, radii)]
        above, falling, _ = matrices(middle)
        above_over, falling_over, within_over = matrices(whole)
        inside = constant(within_over.series)
        if inside < 0:
            return "beyond"
        if definite(above, above_over, radii):
            return "above"
        bounded = inside > 0 and definite(above[1:, 1:], above_over[1:, 1:], radii)
        return "falling" if bounded and definite(falling, falling_over, radii) else None

    with ctx.workprec(128):
        covering = cover(((-tilt, tilt),) * 3, reason, limit)
    return covering.open is None, covering.boxes


def _with(box, radii):
    return enumerate(zip(box, radii, strict=True))
