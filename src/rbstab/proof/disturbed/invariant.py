"""Whether a set of states holds a body for ever, whatever bounded loads act on it.

Let S = {|θ_i| <= ρ, tilt <= ρ} with ρ < π/2. On its border the tilt is ρ: |θ_i| <= tilt for the
angles of eq. 5. Let K = {Θ in S, V <= ℓ}. With numbers α > 0 and β_i > 0 the proof shows that

    V > ℓ for all x and u                                        where the tilt is ρ,
    V is positive definite in (x, u), and
    V' + α(V - ℓ) - Σ β_i(|w_i|² - w̄_i²) < 0 for all x, u, w     where V <= ℓ is possible.

So K is compact, does not touch the border of S, and V' < 0 where V = ℓ and each |w_i| <= w̄_i: no
motion leaves K. All are statements on definite matrices, which hold for all x, u and w at once.
"""

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from rbstab.mechanics.attitude import rotation
from rbstab.proof.boxes import Box, Boxes, as_boxes, joined
from rbstab.proof.disturbed.forms import Forms, Rows
from rbstab.proof.disturbed.matrices import Matrices
from rbstab.proof.enclosures.intervals import constant
from rbstab.proof.exact.expr import expr, variables

LARGEST = Fraction(math.pi / 2)
"""The double below π/2."""

BATCH = 1024
"""Boxes that are examined at once."""

LIMIT = 100_000
"""Boxes at which a proof ends: some minute."""

NARROWEST = 2.0**-9
"""A box that is narrower than this, relative to ρ, is not halved."""


@dataclass(frozen=True)
class Claim:
    """The numbers of a proof.

    Args:
        tilt: ρ, rad, below π/2.
        sizes: w̄ of each load, N m or N.
        weights: β of each load.
        cross: ε, 1/s.
        rate: α, 1/s.
        level: ℓ, J.
    """

    tilt: Fraction
    sizes: tuple[Fraction, ...]
    weights: tuple[Fraction, ...]
    cross: Fraction
    rate: Fraction
    level: Fraction


@dataclass(frozen=True, eq=False)
class Outcome:
    """The end of a proof.

    Args:
        proved: Whether the claim is proved.
        boxes: The number of boxes that were examined.
        where: The middle of a box that was not decided, rad; None if all were.
    """

    proved: bool
    boxes: int
    where: tuple[float, ...] | None = None


def prove(forms: Forms, claim: Claim, limit: int = LIMIT) -> Outcome:
    """Prove that K holds a body for ever, by branch and bound over Θ.

    Args:
        forms: V and V'.
        claim: The numbers.
        limit: The number of boxes at which it ends.

    Raises:
        ValueError: A number of the claim is not above zero, or ρ is not below π/2.
    """
    if not (min(claim.level, claim.rate, claim.tilt, *claim.weights) > 0 and claim.tilt < LARGEST):
        raise ValueError(f"no claim: {claim}")
    matrices = Matrices([*_matrices(forms, claim), _within(claim.tilt)])
    end = np.full(3, constant(claim.tilt)[1, 0])
    pending, examined = as_boxes(Box(-end, end)), 0
    while pending.count:
        boxes, pending = pending[slice(BATCH)], pending[slice(BATCH, None)]
        left = boxes[~_settled(matrices, boxes)]
        examined += boxes.count
        narrow = (left.hi - left.lo).max(axis=0) < NARROWEST * end[0]
        if left.count and (narrow.any() or examined > limit):
            k = int(narrow.argmax())
            return Outcome(False, examined, tuple((0.5 * (left.lo + left.hi)[:, k]).tolist()))
        pending = joined([left.halved(), pending], 3)
    return Outcome(True, examined)


def _settled(matrices: Matrices, boxes: Boxes) -> np.ndarray:
    """Return on which boxes of Θ nothing is left to show."""
    above, falling, within = matrices.over(boxes)
    settled = within.negative.definite()  # beyond the border
    inside = within.definite()
    left = np.flatnonzero(~settled)
    settled[left] = above.part(left).definite()
    left = np.flatnonzero(~settled & inside)
    bounded = above.part(left, slice(1, None)).definite()
    settled[left] = bounded & falling.part(left).definite()
    return settled


def _matrices(forms: Forms, claim: Claim) -> tuple[Rows, Rows]:
    """Return the matrices of V - ℓ and of -(V' + α(V - ℓ) - Σ β(|w|² - w̄²))."""
    above = forms.value(claim.cross)
    above[0][0] = above[0][0] - claim.level
    falling = forms.decrease(claim.cross, claim.rate)
    falling[0][0] = falling[0][0] + claim.rate * claim.level
    for k, (size, weight) in enumerate(zip(claim.sizes, claim.weights, strict=True)):
        falling[0][0] = falling[0][0] - weight * size**2
        for i in range(forms.still + 3 * k, forms.still + 3 * k + 3):
            falling[i][i] = falling[i][i] + weight
    return above, falling


def _within(tilt: Fraction) -> Rows:
    """Return the 1 × 1 matrix that is positive where the tilt is below ρ: tr A - 1 - 2 cos ρ."""
    A = rotation(variables(range(3)))
    return [[expr(A.trace()) - 1 - 2 * expr(tilt).cos()]]
