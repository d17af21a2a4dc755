"""The part of an energy of a user whose force jumps: max(h(Θ), 0), or min(h(Θ), 0), with a kink.

At h = 0 its slope may be any between 0 and ∇h. So over a box in which h may be zero, its slope is
λ∇h with 0 <= λ <= 1. For each such λ, λh is nowhere above max(h, 0), a valley: its force pulls back
to h = 0. And it is nowhere below min(h, 0), a ridge: its force pushes away from h = 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.formulas import jets
from rbstab.analysis.proof.formulas.program import Program
from rbstab.analysis.proof.lines.intervals import Intervals, between, exact
from rbstab.analysis.proof.lines.line import LinePart
from rbstab.analysis.proof.traced.energy import TracedEnergy
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.analysis.proof.trigonometric import TrigonometricForm


@dataclass(frozen=True, eq=False)
class ArgumentBounds:
    """Proved bounds on h over boxes.

    Args:
        value: h at the centres, shape (m,).
        slopes: ∇h at the centres, shape (m, 3).
        range: h over each box, shape (m,).
        slopes_over: ∇h over each box, shape (m, 3).
        hessian_over: The Hessian of h over each box, shape (m, 3, 3).
        ridge: Whether the energy is min(h, 0), and not max(h, 0).
    """

    value: Intervals
    slopes: Intervals
    range: Intervals
    slopes_over: Intervals
    hessian_over: Intervals
    ridge: bool = False

    @property
    def acts(self) -> Array:
        """Whether the energy is h, and not 0, in all of each box, shape (m,)."""
        found: Array = self.range.high < 0 if self.ridge else self.range.low > 0
        return found

    @property
    def jumps(self) -> Array:
        """Whether h may be zero in each box, shape (m,)."""
        return ~((self.range.low > 0) | (self.range.high < 0))

    @property
    def whole(self) -> list[Intervals]:
        """The energy, as `LinePart.over` returns it; with all slopes over a box in which it jumps.

        There its slope is λ∇h(b) at each b in the box, which the Hessian does not bound.
        """
        cut = np.minimum if self.ridge else np.maximum
        value = between(cut(self.value.low, 0.0), cut(self.value.high, 0.0))
        low, high = self.slopes_over.low, self.slopes_over.high
        any_slope = between(np.minimum(low, 0.0), np.maximum(high, 0.0))
        _, slopes, bent, third = self.times(self.acts.astype(float))
        jumps = self.jumps[:, np.newaxis]
        middle = np.where(jumps, any_slope.middle, slopes.middle)
        radius = np.where(jumps, any_slope.radius, slopes.radius)
        return [value, Intervals(middle, radius), bent, third]

    def times(self, share: Array) -> list[Intervals]:
        """Return λh as `LinePart.over` returns a part.

        Args:
            share: λ in each box, shape (m,).
        """
        factor, bent = exact(share), self.hessian_over
        # Nothing of h is nothing, also where its derivatives have no bounds.
        none = (share == 0) & np.isfinite(self.range.middle + self.range.radius)
        found = [
            factor * self.value,
            factor[:, np.newaxis] * self.slopes,
            factor[:, np.newaxis, np.newaxis] * bent,
        ]
        for part in found:
            part.middle[none], part.radius[none] = 0.0, 0.0
        return [*found, exact(np.zeros((*bent.middle.shape, 3)))]


@dataclass(frozen=True, eq=False)
class KinkedEnergy(LinePart):
    """The energy max(h(Θ), 0), or min(h(Θ), 0), J.

    Args:
        name: The name of the element.
        program: h.
        ridge: Whether it is min(h, 0).
        width: J. If it is not zero, `approximate` returns ½(h ± √(h² + width²)), which is smooth.
    """

    name: str
    program: Program
    ridge: bool = False
    width: float = 0.0

    @cached_property
    def argument(self) -> TracedEnergy:
        """h."""
        return TracedEnergy(self.name, self.program)

    @property
    def periodic(self) -> bool:
        """Whether whole turns of θ1 and θ3 leave it as it is."""
        return self.program.periodic

    @property
    def forms(self) -> "Sequence[TrigonometricForm]":
        """None."""
        return ()

    def approximate(self, Theta: Array, order: int) -> list[Array]:
        """Return the derivatives of order 0 to `order` (at most 2) at points, to round-off.

        At a kink they are those of the side where it does not act.
        """
        h, sign = self.argument.approximate(Theta, order), -1.0 if self.ridge else 1.0
        if self.width == 0:
            acts = sign * h[0] > 0
            return [np.where(acts.reshape(-1, *[1] * k), part, 0.0) for k, part in enumerate(h)]
        root = np.sqrt(h[0] * h[0] + self.width * self.width)
        share = 0.5 * (1 + sign * h[0] / root)
        found = [0.5 * (h[0] + sign * root)]
        if order > 0:
            found.append(share[:, np.newaxis] * h[1])
        if order > 1:
            bent = 0.5 * sign * self.width * self.width / root**3
            pairs = np.einsum("mi,mj->mij", h[1], h[1])
            scaled = (one[:, np.newaxis, np.newaxis] for one in (share, bent))
            found.append(next(scaled) * h[2] + next(scaled) * pairs)
        return found

    @np.errstate(all="ignore")  # an entry that is no number has no bound
    def bounds(self, boxes: Boxes) -> ArgumentBounds:
        """Return proved bounds on h over boxes."""
        at_centre, whole = self.argument.jets_over(boxes)
        return ArgumentBounds(
            at_centre.rows[0],
            jets.gradient(at_centre),
            whole.rows[0],
            jets.gradient(whole),
            jets.hessian(whole),
            self.ridge,
        )

    @np.errstate(all="ignore")
    def over(self, t: Array, boxes: Boxes) -> list[Intervals]:
        """Return proved bounds over boxes: see `ArgumentBounds.whole`."""
        return self.bounds(boxes).whole

    @np.errstate(all="ignore")
    def at(self, Theta: Array, order: int) -> list[Intervals]:
        """Return proved bounds on the energy, and on its slopes: at a kink, on all of them."""
        if order > 1:
            raise NotImplementedError("an energy with a kink has bounds on one derivative")
        return self.bounds(Boxes(Theta, Theta)).whole[: order + 1]

    def smoothed(self, width: float) -> "KinkedEnergy":
        """Return a smooth energy within half the width, J: above a valley, and below a ridge."""
        return replace(self, width=width)

    @property
    def steepest(self) -> Array:
        """Bounds on the slopes: see `TracedEnergy.steepest`."""
        return self.argument.steepest

    @property
    def largest(self) -> float:
        """A bound on the magnitude in the same range, J."""
        return self.argument.largest

    @property
    def noise(self) -> tuple[float, Array]:
        """The size of round-off in the energy, J, and in its slopes, shape (3,); not proved."""
        return self.argument.noise
