"""Zeros of ∇U at an angle of θ2 where the slope of a guard jumps: θ2 is held there.

F is U without the guard that jumps. At θ2 = ±θ_s a body is at rest where ∂F/∂θ1 = ∂F/∂θ3 = 0 and
-∂F/∂θ2 is between the slopes of the guard on both sides: 0 and K at +θ_s, -K and 0 at -θ_s, with an
infinite K for a stop. Two variables are left, θ1 and θ3.
"""

from dataclasses import dataclass, replace

import numpy as np

from rbstab.analysis.proof.box_bounds import Enclosure
from rbstab.analysis.proof.boxes import ROUNDING_FACTOR, Boxes
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.soft import SoftEnergy
from rbstab.analysis.proof.index import proved_index
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.proof.zero import MAX_STEP, NEWTON_STEPS, RADII, Zero
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

    def surely_holds(self, low: Array, high: Array) -> Array:
        """Return whether the guard balances all slopes between bounds, with some left over."""
        least, most = (-high, -low) if self.side > 0 else (low, high)
        found: Array = (least > 0) & (most < self.jump.couple * (1 - 1e-15))
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


@np.errstate(all="ignore")  # comparisons with NaN are false
def newton_at_kink(form: TrigonometricForm, kink: Kink, starts: Array) -> tuple[Array, Array]:
    """Run Newton's method for ∂F/∂θ1 = ∂F/∂θ3 = 0 with θ2 of a kink, from many points at once.

    Returns:
        The end points, shape (m, 3), and the last steps, as `newton` returns them. Where the guard
        cannot hold the body, the last step is infinite.
    """
    smooth, Theta = kink.smooth(form), starts.copy()
    Theta[:, 1] = kink.angle
    last = np.full(len(starts), np.inf)
    for _ in range(NEWTON_STEPS):
        _, gradient, hessian = smooth.approximate(Theta, 2)
        step = np.einsum("mkl,ml->mk", _inverses(hessian), gradient[:, FREE])
        last = np.abs(step).max(axis=1)
        shortened = step * np.minimum(1.0, MAX_STEP / last)[:, np.newaxis]
        Theta[:, FREE] -= np.where(np.isfinite(shortened), shortened, 0.0)
        if not np.any(last > 1e-13):
            break
    slope = smooth.approximate(Theta, 1)[1][:, 1]
    return Theta, np.where(kink.holds(slope), last, np.inf)


@np.errstate(all="ignore")
def isolated_kink_zero(form: TrigonometricForm, kink: Kink, Theta: Array) -> Zero | None:
    """Prove that a rest state near a point of a kink exists and is unique; None if that fails.

    Its enclosure has θ2 between `Kink.ends`. In the domain the guard holds each point of the kink:
    -∂F/∂θ2 is strictly between its slopes, so nothing is at rest on either side; and on the kink,
    ∂F/∂θ1 and ∂F/∂θ3 take no pair of values twice.

    Args:
        form: U.
        kink: The kink.
        Theta: The end point of `newton_at_kink`, shape (3,), rad.
    """
    smooth = kink.smooth(form)
    flat, wide = _around(kink, Theta, thin=True), _around(kink, Theta, thin=False)
    exactly_one = np.flatnonzero(_has_one(kink, enclosure(smooth, flat), flat))
    if not len(exactly_one):
        return None
    unique = np.flatnonzero(_at_most_one(kink, enclosure(smooth, wide)))
    enclosed = flat[exactly_one[:1]]
    domain = wide[unique[-1:]] if len(unique) else enclosed
    return Zero(Theta, enclosed, domain, at_kink=True)


def kink_index(form: TrigonometricForm, kink: Kink, box: Boxes) -> int | None:
    """Return the proved index of the Hessian of F by θ1 and θ3 in the enclosure of a rest state."""
    found = enclosure(kink.smooth(form), box)
    block = np.ix_(FREE, FREE)
    return proved_index(found.hessian[0][block], found.hessian_radius[0][block])


def _around(kink: Kink, Theta: Array, *, thin: bool) -> Boxes:
    """Return the boxes with `RADII` about a point of a kink: as thin as it is, or not."""
    low, high = kink.ends
    reach = np.zeros_like(RADII) if thin else RADII
    centre = np.broadcast_to(Theta, (len(RADII), 3)).copy()
    lower, upper = centre - RADII[:, np.newaxis], centre + RADII[:, np.newaxis]
    lower[:, 1], upper[:, 1] = low - reach, high + reach
    return Boxes(np.nextafter(lower, -np.inf), np.nextafter(upper, np.inf))


def _at_most_one(kink: Kink, found: Enclosure) -> Array:
    """Return whether each box has at most one rest state, as it would be on the kink; (m,)."""
    sums = _residual(found)[0].sum(axis=2) * ROUNDING_FACTOR
    low, high = found.gradient_bounds
    found_one: Array = np.all(sums < 1, axis=1) & kink.surely_holds(low[:, 1], high[:, 1])
    return found_one


def _has_one(kink: Kink, found: Enclosure, boxes: Boxes) -> Array:
    """Return whether each thin box has exactly one rest state: `_at_most_one` and Krawczyk's test.

    For the exact θ2 of the kink, |Y∇F| at the centre is at most that of the gradient there plus
    what the distance in θ2 changes.
    """
    residual, Y = _residual(found)
    size, radius = np.abs(Y), found.radius
    step = np.abs(np.einsum("mkl,ml->mk", Y, found.gradient[:, FREE]))
    error = np.broadcast_to(found.gradient_error, found.gradient.shape)[:, FREE]
    error = error + 1e-15 * np.abs(found.gradient[:, FREE])
    across = np.abs(found.hessian[:, FREE, 1]) + found.hessian_radius[:, FREE, 1]
    error = error + across * radius[:, 1:2]
    image = step + np.einsum("mkl,ml->mk", size, error) * ROUNDING_FACTOR
    image = image + np.einsum("mkj,mj->mk", residual, radius[:, FREE])
    inner = boxes.inner_radius[:, FREE]
    return _at_most_one(kink, found) & np.all(image * ROUNDING_FACTOR < inner, axis=1)


def _residual(found: Enclosure) -> tuple[Array, Array]:
    """Bound |I - YH| by θ1 and θ3 over each box; return the bounds and Y, shape (m, 2, 2) each."""
    block = found.hessian[:, FREE[:, np.newaxis], FREE]
    Y = _inverses(found.hessian)
    size = np.abs(Y)
    product = np.einsum("mkl,mlj->mkj", Y, block)
    error = 1e-15 * np.einsum("mkl,mlj->mkj", size, np.abs(block))
    spread = found.hessian_radius[:, FREE[:, np.newaxis], FREE]
    residual = np.abs(np.eye(2) - product) + error + np.einsum("mkl,mlj->mkj", size, spread)
    return residual * ROUNDING_FACTOR, Y


def _inverses(hessian: Array) -> Array:
    """Invert the blocks of θ1 and θ3, shape (m, 2, 2); not finite for a singular one."""
    block = hessian[:, FREE[:, np.newaxis], FREE]
    a, b, c, d = block[:, 0, 0], block[:, 0, 1], block[:, 1, 0], block[:, 1, 1]
    rows = np.stack([np.stack([d, -b], axis=1), np.stack([-c, a], axis=1)], axis=1)
    found: Array = rows / (a * d - b * c)[:, np.newaxis, np.newaxis]
    return found
