"""A body that is not held, with springs: its energy is not convex in the position (theorem 12).

With W of `lengths`, S >= λI, P = Σ w_j, and N convex in z, let ∂W/∂z = 0 at z. As |∂|z + r||= 1,

    λ|z|² <= z'(Sz + ∂N(z) - ∂N(0)) <= |z| (P + |∂N(0)|),    so |z| <= ρ = (P + |∂N(Θ, 0)|)/λ.

For these z no line is shorter than |r_j| - ρ. The second derivatives of -w|e| are at least -w/|e|,
so W is convex there if λ > Σ w_j/(|r_j| - ρ). Then it has one stationary point z, its minimiser.
"""

from fractions import Fraction

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.bounds import UP, BoundedEnergy
from rbstab.proof.enclosures.taylor import Values
from rbstab.proof.exact.expr import Expr
from rbstab.proof.exact.lengths import Springs, springs_of
from rbstab.proof.model import Energy

ANGLES = (0, 1, 2)


class TiedBounds(BoundedEnergy):
    """The least W over z, over boxes of Θ.

    Args:
        energy: W and the variables z.
        springs: W, taken apart; it has lines.
        order: As for `BoundedEnergy`.
    """

    def __init__(self, energy: Energy, springs: Springs, order: int = 3) -> None:
        free, least = energy.free, energy.least
        lengths = [Expr({line.monomial: Fraction(1)}) for line in springs.lines]
        super().__init__(energy.U, free=free, least=least, order=order, also=lengths)
        self.stiffness = float(springs.stiffness) / UP
        self.weights = [float(line.weight) * UP for line in springs.lines]
        N = springs.convex
        self.rest = BoundedEnergy(N, (*ANGLES, *free), least=least, order=2) if N.terms else None

    def is_single(self, x: Array, values: Values, size: Array) -> Array:
        """Return whether W has one stationary point z, its minimiser, for all Θ of each box.

        Args:
            x: The ends of the boxes, shape (n, 2, boxes).
            values: The values of W and of the lengths over each box.
            size: The largest |z_i| of these, shape (free, boxes).
        """
        # |r_j| is at least |z + r_j| - |z| for any z.
        pull = sum(self.weights) + self._pull(x)
        away = (pull / self.stiffness + np.sqrt((size**2).sum(axis=0))) * UP
        softer = np.zeros(x.shape[2])
        for k, weight in enumerate(self.weights, start=1):
            shortest = values.coefficients(k)[0, 0] / UP - away
            softer += np.where(shortest > 0, weight / shortest * UP, np.inf)
        return np.asarray(softer * UP < self.stiffness)

    def _pull(self, x: Array) -> Array:
        """Bound |∂N/∂z| at z = 0 over boxes, N."""
        if self.rest is None:
            return np.zeros(x.shape[2])
        ends = np.concatenate([x, np.zeros((self.k, *x.shape[1:]))])
        slopes = self.rest.over(ends[:, 0], ends[:, 1]).slopes.mag[self.n :]
        return np.asarray(np.sqrt((slopes**2).sum(axis=0)) * UP)


def bounds_of(energy: Energy, order: int = 3) -> BoundedEnergy:
    """Return bounds on an energy, least over its free variables.

    Args:
        energy: The energy.
        order: 3, or 2 for bounds without third derivatives.

    Raises:
        NotSingleError: It has springs, and it is not shown that all else is convex in z.
    """
    springs = springs_of(energy.U, energy.free) if energy.free else None
    if springs is None or not springs.lines:
        return BoundedEnergy(energy.U, free=energy.free, least=energy.least, order=order)
    return TiedBounds(energy, springs, order)


def without_lengths(energy: Energy) -> list[BoundedEnergy]:
    """Return bounds on W where a spring has no length, for each spring: z = -r_j(Θ)."""
    if not energy.free:
        return []
    return [
        BoundedEnergy(W, least=energy.least)
        for W in springs_of(energy.U, energy.free).collapsed(energy.U, energy.free)
    ]
