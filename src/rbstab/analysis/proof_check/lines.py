"""The length of a line as a part of a reduced energy, in balls: w √s(Θ).

All derivatives follow from ℓ² = s, differentiated once to three times:

    2ℓ ℓ_i = s_i        2ℓ ℓ_ij = s_ij - 2 ℓ_i ℓ_j
    2ℓ ℓ_ijk = s_ijk - 2 (ℓ_ij ℓ_k + ℓ_ik ℓ_j + ℓ_jk ℓ_i)
"""

from collections.abc import Mapping, Sequence
from typing import Any

from flint import arb

from rbstab.analysis.proof_check.boxes import AXES, Box
from rbstab.analysis.proof_check.cover import Cover, cover
from rbstab.analysis.proof_check.trigonometric import (
    ORDERS,
    Axes,
    Ball,
    TrigonometricSum,
    rounded,
)

BOX_LIMIT = 40_000
"""The number of boxes at which the search for an attitude without length stops."""


class Line:
    """The energy w √s of a line.

    Args:
        data: The weight w, N, and the coefficients of s, m².

    Raises:
        ValueError: s has a multiple of an angle.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.weight = rounded(data["weight"])
        self.square = TrigonometricSum(data["coefficients"])
        if self.square.highest > 1:
            raise ValueError("The square of a length has a multiple of an angle")

    def derivatives(self, Theta: Sequence[Ball]) -> dict[Axes, Ball]:
        """Return the derivatives at a ball of Θ, up to order 3; no numbers where s may be zero."""
        s = self._square(Theta)
        length = s[()].sqrt()
        found: dict[Axes, Ball] = {(): length}
        for axes in ORDERS:
            if axes:
                products = sum((found[one] * found[two] for one, two in _splits(axes)), arb(0))
                found[axes] = (s[axes] / 2 - products) / length
        return {axes: self.weight * value for axes, value in found.items()}

    def _square(self, Theta: Sequence[Ball]) -> dict[Axes, Ball]:
        """Return s and its derivatives. Over a wide ball, those about its middle are sharper."""
        wide = self.square.derivatives(Theta)
        steps = [angle - angle.mid() for angle in Theta]
        if all(step == 0 for step in steps):
            return wide
        middle = self.square.derivatives([angle.mid() for angle in Theta])
        for axes in sorted(wide, key=len, reverse=True):
            if len(axes) < 3:
                slopes = (wide[tuple(sorted((*axes, k)))] * steps[k] for k in AXES)
                about_middle = sum(slopes, middle[axes])
                if about_middle.rad() < wide[axes].rad():
                    wide[axes] = about_middle
        return wide

    def steepest(self, axis: int) -> Ball:
        """Bound the derivative along an axis, at any Θ (lemma 7)."""
        return abs(self.weight) * (self.square.steepest(axis) / 2).abs_upper().sqrt()

    def lengths(self) -> Cover:
        """Cover all attitudes by boxes in which s is positive, for the reason "l"."""
        end = 3.2  # beyond π: s is periodic
        whole: Box = ((-end, end),) * 3

        def reason(box: Box) -> str | None:
            Theta = [arb(low).union(arb(high)) for low, high in box]
            return "l" if self._square(Theta)[()] > 0 else None

        return cover(whole, reason, BOX_LIMIT)


def _splits(axes: Axes) -> list[tuple[Axes, Axes]]:
    """Return all ways to divide derivatives between two equal factors, none of them undivided."""
    if len(axes) == 2:
        return [(axes[:1], axes[1:])]
    return [((*axes[:k], *axes[k + 1 :]), axes[k : k + 1]) for k in range(len(axes)) if axes[1:]]
