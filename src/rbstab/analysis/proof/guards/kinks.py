"""Zeros of ∇U at an angle of θ2 where the slope of a guard jumps: θ2 is held there.

F is U without the guard that jumps. At θ2 = ±θ_s a body is at rest where ∂F/∂θ1 = ∂F/∂θ3 = 0 and
-∂F/∂θ2 is between the slopes of the guard on both sides: 0 and K at +θ_s, -K and 0 at -θ_s, with an
infinite K for a stop. Two variables are left, θ1 and θ3.
"""

from dataclasses import dataclass, replace

import numpy as np

from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.soft import SoftEnergy
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

FREE = np.array([0, 2])
"""θ1 and θ3 among the angles."""

SAME_ANGLE = 1e-14
"""A point is at a kink if its θ2 differs from that of the kink by less, relative to it."""


@dataclass(frozen=True)
class Kink:
    """A value of θ2 at which the slope of a guard jumps.

    Args:
        side: 1 for +θ_s, -1 for -θ_s.
        jump: The guard.
    """

    side: int
    jump: SoftEnergy

    @property
    def angle(self) -> float:
        """θ2 at the kink, to the last digit, rad."""
        return self.side * self.jump.angle

    @property
    def ends(self) -> tuple[float, float]:
        """Two doubles with the exact θ2 between them."""
        low, high = sorted((self.side * self.jump.inner, self.side * self.jump.outer))
        return low, high

    @property
    def slope_beyond(self) -> Array:
        """The gradient that the guard adds just beyond the kink, shape (3,); none of a stop."""
        couple = 0.0 if self.jump.is_stop else self.jump.couple
        return np.array([0.0, self.side * couple, 0.0])

    def smooth(self, form: TrigonometricForm) -> TrigonometricForm:
        """Return F, the form without the guard that jumps here."""
        assert form.guard is not None
        guard = form.guard.without(self.jump)
        return replace(form, guard=guard if guard.barrier or guard.soft else None)

    def holds(self, slope: Array) -> Array:
        """Return whether the guard can balance a slope ∂F/∂θ2 here, computed in doubles."""
        pressing = -self.side * slope
        found: Array = (pressing >= 0) & (pressing <= self.jump.couple)
        return found


def kinks_of(guard: Guard | None) -> list[Kink]:
    """Return all kinks of some guards that a motion may reach."""
    if guard is None:
        return []
    near = [one for one in guard.jumps if one.angle <= (guard.stop or np.inf)]
    return [Kink(side, one) for one in near for side in (-1, 1)]


def kink_at(guard: Guard | None, pitch: float) -> Kink | None:
    """Return the kink at a value of θ2; None if there is none."""
    for kink in kinks_of(guard):
        if abs(pitch - kink.angle) <= SAME_ANGLE * abs(kink.angle):
            return kink
    return None
