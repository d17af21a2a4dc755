"""The energy of a body with a parameter p, and bounds on it that hold for all p of an interval.

p is one more variable of V(Θ, p). Over a box of Θ with the centre m, and an interval about p0,

    ∇V(Θ, p) = ∇V(m, p0) + S (Θ - m) + s (p - p0),

with derivatives by Θ in ∇. The last term is one more error of the gradient at m. So whatever a
search proves from these bounds holds for each p: one rest state in a box, none elsewhere, an index.
"""

import math
from fractions import Fraction

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box
from rbstab.proof.enclosures.bounds import UP, BoundedEnergy, Bounds, Matrices, Minimiser
from rbstab.proof.exact.atoms import VAR
from rbstab.proof.exact.expr import atom, expr
from rbstab.proof.exact.matrices import inverse_of_definite
from rbstab.proof.exact.rewriting import quadratic_in, substituted
from rbstab.proof.model import RANGE_END, THETA, Energy
from rbstab.proof.pieces import jumps
from rbstab.proof.reasons import NoEnergyReason, NoReducedEnergy
from rbstab.proof.robust.numbers import FIRST

RANGE = Box(-RANGE_END, RANGE_END)
"""The closed range of eq. 5."""


class AlongEnergy(BoundedEnergy):
    """V(Θ, p), with the variable `FIRST` for p: the last of four variables.

    U has to be quadratic in z, with a stiffness that is affine in p. It is definite at both ends of
    the interval, and so between.

    Args:
        energy: The energy.
        low: The lower end of the interval.
        high: The upper end.

    Raises:
        NoReducedEnergy: U is not such an energy; or a stop, or a force that jumps, may hold the
            body, so that not all rest states are zeros of ∇V.
    """

    def __init__(self, energy: Energy, low: float, high: float) -> None:
        if energy.stop is not None or jumps(energy):
            raise NoReducedEnergy(NoEnergyReason.HELD_ALONG)
        self.low, self.high = low, high
        # An end means its decimal, which may lie beside its double.
        self.ends = math.nextafter(low, -math.inf), math.nextafter(high, math.inf)
        p, free = atom(VAR, FIRST), set(energy.free)
        beside = [[one for one in m if not one[0].variables & free] for m in energy.U.terms]
        degrees = [sum(n for a, n in m if a.variables & free) for m in energy.U.terms]
        pairs = zip(degrees, beside, strict=True)
        affine = all(rest in ([], [(p, 1)]) for degree, rest in pairs if degree == 2)
        for end in self.ends:
            parts = quadratic_in(substituted(energy.U, {p: expr(Fraction(end))}), energy.free)
            definite = inverse_of_definite(parts.H) is not None
            if not (affine and definite) or parts.rest.variables & free:
                raise NoReducedEnergy(NoEnergyReason.NOT_QUADRATIC)
        super().__init__(energy.U, (*THETA, FIRST), energy.free, energy.least)


class OverInterval(BoundedEnergy):
    """V(Θ, p) as a function of Θ, with bounds that hold for all p of an interval.

    At points it is that of the middle of the interval.

    Args:
        whole: V(Θ, p).
        low: The lower end of the interval.
        high: The upper end.
    """

    def __init__(self, whole: AlongEnergy, low: float, high: float) -> None:
        self.whole, self.low, self.high = whole, low, high
        self.variables, self.free, self.least = THETA, whole.free, whole.least
        self.n, self.k, self.theta, self.z = 3, whole.k, slice(0, 3), slice(3, None)

    def over(self, lo: Array, hi: Array) -> Bounds:
        """Return bounds over the boxes lo <= Θ <= hi, both of shape (3, boxes)."""
        b = self.whole.over(_with(lo, self.low), _with(hi, self.high))
        a, r = self.theta, b.radius[3]
        S, s, H, h = *b.slope, *b.hessian
        with np.errstate(all="ignore"):
            moved = (np.abs(S[a, 3]) + s[a, 3]) * r * UP
            raised = b.slopes[3].mag * r * UP
        return Bounds(
            b.centre[a],
            b.radius[a],
            b.value.widened(raised, raised),
            b.gradient[a].widened(moved, moved),
            b.gradient_over[a],
            Matrices(S[a, a], s[a, a]),
            Matrices(H[a, a], h[a, a]),
            b.value_over,
        )

    def _middle(self, points: Array) -> Array:
        return _with(points, 0.5 * self.low + 0.5 * self.high)

    def minimiser(self, points: Array) -> Minimiser:
        """Return z near the lowest point at some points of shape (3, points), to round-off."""
        z, C, inverse = self.whole.minimiser(self._middle(points))
        return Minimiser(z, C[:, self.theta], inverse)

    def at_all(self, points: Array, z: Array) -> tuple[Array, Array, Array]:
        """Return V, ∇V and ∇²V by Θ and z at points (3, points) and z (free, points)."""
        value, g, H = self.whole.at_all(self._middle(points), z)
        return value, np.delete(g, 3, 0), np.delete(np.delete(H, 3, 0), 3, 1)


def _with(Theta: Array, p: float) -> Array:
    return np.vstack([Theta, np.full((1, Theta.shape[1]), p)])
