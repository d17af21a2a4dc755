"""The energy of a ligament, in balls, as a function of its length ℓ.

With the strain ε = ℓ/ℓ₀ - 1, the energy Φ has the derivatives by ℓ

    Φ' = k ε²/(4 ε_t)        Φ'' = k ε/(2 ε_t ℓ₀)        Φ''' = k/(2 ε_t ℓ₀²)

in the toe, 0 < ε < 2 ε_t, and k (ε - ε_t), k/ℓ₀, 0 beyond it; all are 0 where it is slack. Φ'''
jumps; a ball that contains a jump has the values on both sides.
"""

from collections.abc import Mapping
from typing import Any

from flint import arb

from rbstab.analysis.proof_check.trigonometric import Ball, rounded, square


class LigamentLaw:
    """Φ with its derivatives by ℓ.

    Args:
        data: stiffness, N, slack_length, m, and toe_strain.

    Raises:
        ValueError: One of them is not positive.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        names = ("stiffness", "slack_length", "toe_strain")
        if not all(data[name] > 0 for name in names):
            raise ValueError("A number of a ligament is not positive")
        self.k, self.slack_length, self.toe = (rounded(data[name]) for name in names)

    def derivatives(self, length: Ball) -> list[Ball]:
        """Return Φ and its derivatives up to order 3 at a ball of lengths."""
        strain = length / self.slack_length - 1
        end = 2 * self.toe
        found = list[list[Ball]]()
        if not strain > 0:
            found.append([arb(0)] * 4)
        if not (strain <= 0 or strain >= end):
            inside = _within(strain, arb(0), end)
            found.append(self._in_toe(inside))
        if not strain < end:
            beyond = strain.max(end)
            k, toe = self.k, self.toe
            energy = square(beyond - toe) / 2 + square(toe) / 6
            found.append(
                [
                    self.slack_length * k * energy,
                    k * (beyond - toe),
                    k / self.slack_length,
                    arb(0),
                ]
            )
        first, *others = found
        for other in others:
            first = [one.union(two) for one, two in zip(first, other, strict=True)]
        return first

    def across_and_excess(self, length: Ball) -> tuple[Ball, Ball]:
        """Return Φ'/ℓ and Φ'' - Φ'/ℓ at a ball of lengths of at least ℓ₀.

        Φ'/ℓ never falls with ℓ, so its values at the ends are enough. With y = ℓ/ℓ₀ the other one
        is k (y - 1/y)/(4 ε_t ℓ₀) in the toe, and k (1 + ε_t)/(ℓ₀ y) beyond it.
        """
        ends = [arb(length.lower()), arb(length.upper())]
        low, high = (self.derivatives(end)[1] / end for end in ends)
        y, border = length / self.slack_length, 1 + 2 * self.toe
        found = list[Ball]()
        if not y >= border:
            first, last = (_within(end / self.slack_length, arb(1), border) for end in ends)
            factor = self.k / (4 * self.toe * self.slack_length)
            found += [factor * (one - 1 / one) for one in (first, last)]
        if not y <= border:
            factor = self.k * (1 + self.toe) / self.slack_length
            found.append(factor / y.max(border))
        excess, *others = found
        for other in others:
            excess = excess.union(other)
        return low.union(high), excess

    def _in_toe(self, strain: Ball) -> list[Ball]:
        k, toe, length = self.k, self.toe, self.slack_length
        return [
            length * k * strain * square(strain) / (12 * toe),
            k * square(strain) / (4 * toe),
            k * strain / (2 * toe * length),
            k / (2 * toe * square(length)),
        ]


def _within(ball: Ball, low: Ball, high: Ball) -> Ball:
    """Return the part of a ball between two others, as far as it is known."""
    return ball.max(low).min(high)
