"""The energy of a body with a parameter p, and bounds on it that hold for all p of an interval.

p is one more variable of V(Θ, p). Over a box of Θ with the centre m, and an interval about p0,

    ∇V(Θ, p) = ∇V(m, p0) + S (Θ - m) + s (p - p0),

with derivatives by Θ in ∇. The last term is one more error of the gradient at m. So whatever a
search proves from these bounds holds for each p: one rest state in a box, none elsewhere, an index.
"""

from fractions import Fraction

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box
from rbstab.proof.enclosures.bounds import UP, BoundedEnergy, Bounds, Matrices
from rbstab.proof.exact.atoms import VAR
from rbstab.proof.exact.expr import Expr, atom, expr, variable
from rbstab.proof.exact.matrices import inverse_of_definite
from rbstab.proof.exact.rewriting import quadratic_in, substituted
from rbstab.proof.model import RANGE_END, THETA, Energy
from rbstab.proof.pieces import jumps
from rbstab.proof.reasons import NoEnergyReason, NoReducedEnergy
from rbstab.proof.robust.numbers import FIRST

RANGE = Box(-RANGE_END, RANGE_END)
"""The closed range of eq. 5."""


def parameter_between(low: float, high: float) -> Expr:
    """Return p as the middle of an interval plus the variable `FIRST`.

    So what does not depend on this variable, as a stiffness of z, is that of a body in the middle.
    """
    return variable(FIRST) + Fraction(0.5 * low + 0.5 * high)


def _at(U: Expr, q: float) -> Expr:
    return substituted(U, {atom(VAR, FIRST): expr(Fraction(q))})


class AlongEnergy(BoundedEnergy):
    """V(Θ, p), with the variable `FIRST` of `parameter_between`: the last of four variables.

    U has to be quadratic in z, with a stiffness that is affine in p. It is definite at both ends of
    the interval, and so between.

    Args:
        energy: The energy, made with `parameter_between`.
        low: The lower end of the interval.
        high: The upper end.

    Raises:
        NoReducedEnergy: U is not such an energy; or a stop, or a force that jumps, may hold the
            body, so that not all rest states are zeros of ∇V.
    """

    def __init__(self, energy: Energy, low: float, high: float) -> None:
        if energy.stop is not None or jumps(energy):
            raise NoReducedEnergy(NoEnergyReason.HELD_ALONG)
        free, parts = set(energy.free), quadratic_in(energy.U, energy.free)
        left = {m for m in parts.rest.terms if any(a.variables & free for a, _ in m)}
        q, z = variable(FIRST), [variable(k) for k in free]
        is_quadratic = left <= {m for i in z for j in z for m in (q * i * j).terms}
        is_quadratic &= not any(b.variables & free for b in parts.b)
        self.low, self.high, self.middle = low, high, 0.5 * low + 0.5 * high
        ends = (quadratic_in(_at(energy.U, q), energy.free).H for q in self.about(low, high))
        if not is_quadratic or any(inverse_of_definite(H) is None for H in ends):
            raise NoReducedEnergy(NoEnergyReason.NOT_QUADRATIC)
        super().__init__(energy.U, (*THETA, FIRST), energy.free, energy.least)

    def about(self, low: float, high: float) -> Array:
        """Return the ends of an interval of the variable that contains one of p.

        It is wider, as differences are rounded, and ends of p mean their decimals.
        """
        outward = np.array([-np.inf, np.inf])
        return np.nextafter(np.nextafter([low, high], outward) - self.middle, outward)


class OverInterval(BoundedEnergy):
    """V(Θ, p) as a function of Θ, with bounds that hold for all p of an interval.

    At points it is that of the middle of the interval.

    Args:
        whole: V(Θ, p).
        low: The lower end of the interval.
        high: The upper end.
    """

    def __init__(self, whole: AlongEnergy, low: float, high: float) -> None:
        self.whole, self.ends = whole, whole.about(low, high)
        middle = _at(whole.U, 0.5 * self.ends.sum())
        super().__init__(middle, free=whole.free, least=whole.least, order=2)

    def over(self, lo: Array, hi: Array) -> Bounds:
        """Return bounds over the boxes lo <= Θ <= hi, both of shape (3, boxes)."""
        both = zip((lo, hi), self.ends, strict=True)
        b = self.whole.over(*(np.vstack([x, 0 * x[:1] + q]) for x, q in both))
        a, r = self.theta, b.radius[3]
        S, s, H, h = *b.slope, *b.hessian
        with np.errstate(all="ignore"):
            moved = (np.abs(S[a, 3]) + s[a, 3]) * r * UP
        return Bounds(
            b.centre[a],
            b.radius[a],
            b.value_over,
            b.gradient[a].widened(moved, moved),
            b.gradient_over[a],
            Matrices(S[a, a], s[a, a]),
            Matrices(H[a, a], h[a, a]),
            b.value_over,
        )
