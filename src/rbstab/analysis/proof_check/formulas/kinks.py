"""The part of an energy of a user whose force jumps: max(h(Θ), 0), or min(h(Θ), 0), in balls.

At h = 0 its slope may be any between 0 and ∇h. If 0 <= λ <= 1, λh is nowhere above max(h, 0), and
nowhere below min(h, 0): that one is a ridge, from which the force pushes away.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.formulas.formula import Formula, Over
from rbstab.analysis.proof_check.trigonometric import Ball

ANY_SHARE = arb(0.5, 0.5)
"""All λ."""


class Kink(Formula):
    """max(h, 0). As a `Formula` it is h; `value` and `switches` alone are those of the energy."""

    ridge = False

    @staticmethod
    def cut(h: Ball) -> Ball:
        """Return max(h, 0)."""
        return h.max(arb(0))

    def value(self, Theta: Sequence[Ball]) -> Ball:
        """Return the energy at a ball of Θ."""
        return self.cut(super().value(Theta))

    def switches(self, Theta: Sequence[Ball]) -> list[Ball]:
        """Return at a point what changes its sign where the energy switches: h too."""
        return [*super().switches(Theta), super().value(Theta)]


class Ridge(Kink):
    """min(h, 0), with the formula h."""

    ridge = True

    @staticmethod
    def cut(h: Ball) -> Ball:
        """Return min(h, 0)."""
        return h.min(arb(0))


def signs_over(kink: Kink, centre: Sequence[Ball], step: Sequence[Ball]) -> frozenset[int]:
    """Return the signs that h may have over a box: 1, -1, or both. Zero has both."""
    h = kink.over(centre, step).values
    return frozenset(sign for sign in (-1, 1) if not sign * h < 0)


class KinkOver:
    """A kink over a box, as `Over` has a formula, with all slopes if it may jump in the box.

    Args:
        kink: The part.
        centre: The centre of the box.
        step: The balls of Θ - centre.

    Attributes:
        argument: h over the box.
        jumps: Whether h may be zero in the box.
        acts: Whether the energy is h, and not 0, in all of the box.
    """

    def __init__(self, kink: Kink, centre: Sequence[Ball], step: Sequence[Ball]) -> None:
        self.kink = kink
        self.argument = argument = kink.over(centre, step)
        above, below = bool(argument.values > 0), bool(argument.values < 0)
        self.jumps = not (above or below)
        self.acts = acts = below if kink.ridge else above
        share = arb(int(acts))
        self.value = kink.cut(argument.value) if self.jumps else share * argument.value
        slopes, factor = (argument.slopes, ANY_SHARE) if self.jumps else (argument.gradient, share)
        rests = not (acts or self.jumps)
        self.gradient = [factor * one for one in slopes] if not rests else [arb(0)] * 3
        self.hessian = argument.hessian if acts else arb_mat(3, 3)


class Share:
    """λh over a box, as `Over` has a formula.

    Args:
        argument: h over the box.
        share: λ, a double.
    """

    def __init__(self, argument: Over, share: float) -> None:
        self.share = arb(share)
        self.value = self.share * argument.value
        self.gradient = [self.share * one for one in argument.gradient]
        self.hessian = self.share * argument.hessian


def kinks_of(data: Mapping[str, Any]) -> list[Kink]:
    """Return the kinks of `reduced_energy` of a proof.

    Raises:
        ValueError: One of them is no formula.
    """
    valleys, ridges = (data.get(key) or () for key in ("kinks", "ridges"))
    return [*(Kink(one) for one in valleys), *(Ridge(one) for one in ridges)]
