"""Functions of the length of a line as parts of a reduced energy, in balls: w √s(Θ), or Φ(√s(Θ)).

All derivatives follow from ℓ² = s, differentiated once to three times:

    2ℓ ℓ_i = s_i        2ℓ ℓ_ij = s_ij - 2 ℓ_i ℓ_j
    2ℓ ℓ_ijk = s_ijk - 2 (ℓ_ij ℓ_k + ℓ_ik ℓ_j + ℓ_jk ℓ_i)

The energy of a spring has w ℓ, that of a ligament is a function of ℓ (`ligaments.py`).
"""

from collections.abc import Mapping, Sequence
from typing import Any

from flint import arb

from rbstab.analysis.proof_check.boxes import AXES, Box
from rbstab.analysis.proof_check.cover import Cover, cover
from rbstab.analysis.proof_check.lengths.ligaments import LigamentLaw
from rbstab.analysis.proof_check.trigonometric import (
    ORDERS,
    Axes,
    Ball,
    TrigonometricSum,
    rounded,
    square,
)

BOX_LIMIT = 40_000
"""The number of boxes at which the search for an attitude without length stops."""


class Length:
    """The length √s of a line.

    Args:
        coefficients: Those of s, m².

    Raises:
        ValueError: s has a multiple of an angle.
    """

    def __init__(self, coefficients: Sequence[Sequence[Sequence[float]]]) -> None:
        self.square = TrigonometricSum(coefficients)
        if self.square.highest > 1:
            raise ValueError("The square of a length has a multiple of an angle")

    def _lengths(self, s: Mapping[Axes, Ball]) -> dict[Axes, Ball]:
        """Return ℓ and its derivatives from those of s; no numbers where s may be zero."""
        length = s[()].sqrt()
        found: dict[Axes, Ball] = {(): length}
        for axes in ORDERS:
            if axes:
                products = sum((found[one] * found[two] for one, two in _splits(axes)), arb(0))
                found[axes] = (s[axes] / 2 - products) / length
        return found

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

    def _steepest(self, axis: int) -> Ball:
        """Bound the derivative of ℓ along an axis, at any Θ (lemma 7)."""
        return (self.square.steepest(axis) / 2).abs_upper().sqrt()


class Line(Length):
    """The energy w √s of a line.

    Args:
        data: The weight w, N, and the coefficients of s, m².
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        super().__init__(data["coefficients"])
        self.weight = rounded(data["weight"])

    def derivatives(self, Theta: Sequence[Ball]) -> dict[Axes, Ball]:
        """Return the derivatives at a ball of Θ, up to order 3; no numbers where s may be zero."""
        found = self._lengths(self._square(Theta))
        return {axes: self.weight * value for axes, value in found.items()}

    def steepest(self, axis: int) -> Ball:
        """Bound the derivative along an axis, at any Θ."""
        return abs(self.weight) * self._steepest(axis)

    def lengths(self) -> Cover:
        """Cover all attitudes by boxes in which s is positive, for the reason "l"."""
        end = 3.2  # beyond π: s is periodic
        whole: Box = ((-end, end),) * 3

        def reason(box: Box) -> str | None:
            Theta = [arb(low).union(arb(high)) for low, high in box]
            return "l" if self._square(Theta)[()] > 0 else None

        return cover(whole, reason, BOX_LIMIT)


class Ligament(Length):
    """The energy Φ(√s) of a ligament.

    Args:
        data: The numbers of its law, and the coefficients of s, m².
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        super().__init__(data["coefficients"])
        self.law = LigamentLaw(data)

    def derivatives(self, Theta: Sequence[Ball]) -> dict[Axes, Ball]:
        """Return the derivatives at a ball of Θ, up to order 3.

        They are 0 where it is slack. They are no numbers where it may be taut, and may have no
        length.
        """
        s = self._square(Theta)
        if s[()] < square(self.law.slack_length):
            return {axes: arb(0) for axes in ORDERS}
        length = self._lengths(s)
        energy, first, second, third = self.law.derivatives(length[()])
        found: dict[Axes, Ball] = {(): energy}
        for axes in ORDERS:
            if not axes:
                continue
            found[axes] = first * length[axes]
            products = (length[one] * length[two] for one, two in _splits(axes))
            found[axes] += second * sum(products, arb(0))
            if len(axes) == 3:
                i, j, k = axes
                found[axes] += third * length[i,] * length[j,] * length[k,]
        return found

    def steepest(self, axis: int) -> Ball:
        """Bound the derivative along an axis, at any Θ: the largest tension, and that of ℓ."""
        farthest = self.square.derivatives([arb(0, 4)] * 3)[()].abs_upper().sqrt()
        return self.law.derivatives(farthest)[1].abs_upper() * self._steepest(axis)


def _splits(axes: Axes) -> list[tuple[Axes, Axes]]:
    """Return all ways to divide derivatives between two equal factors, none of them undivided."""
    if len(axes) == 2:
        return [(axes[:1], axes[1:])]
    return [((*axes[:k], *axes[k + 1 :]), axes[k : k + 1]) for k in range(len(axes)) if axes[1:]]
