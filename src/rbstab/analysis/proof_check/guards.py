"""What guards add to the energy of a proof, in balls: barriers, soft guards and stops."""

from collections.abc import Mapping
from functools import reduce
from typing import Any, NamedTuple

from flint import arb

from rbstab.analysis.proof_check.trigonometric import Ball, rounded, square


def barrier(stiffness: Ball, angle: Ball) -> list[Ball]:
    """Return ½ k tan² θ and its derivatives up to order 3; no numbers if the ball reaches ±π/2.

    They rise with |θ|, in size. So over a ball they are between those at its ends, and at 0.
    """
    low, high = arb(angle.lower()), arb(angle.upper())
    if not (-arb.pi() / 2 < low and high < arb.pi() / 2):
        return [arb("nan")] * 4
    points = [low, high, *([] if low > 0 or high < 0 else [arb(0)])]
    first, *others = (_barrier_at(stiffness, point) for point in points)
    return [reduce(arb.union, terms, one) for one, *terms in zip(first, *others, strict=True)]


def _barrier_at(stiffness: Ball, angle: Ball) -> list[Ball]:
    """Return the same at a point."""
    t = angle.tan()
    tt = square(t)
    ss = 1 + tt  # 1/cos² θ, the derivative of tan θ
    terms = [tt / 2, t * ss, ss * (ss + 2 * tt), 4 * t * ss * (2 * ss + tt)]
    return [stiffness * term for term in terms]


def outer_barrier(stiffness: Ball, angle: Ball) -> list[Ball]:
    """Return ½ k tan²(θ/2) and its derivatives up to order 3, as `barrier` does, up to ±π."""
    return [term / 2**order for order, term in enumerate(barrier(stiffness, angle / 2))]


class Barrier(NamedTuple):
    """A barrier on one angle.

    Attributes:
        stiffness: k, a ball, N m.
        axis: The axis of the angle.
    """

    stiffness: Ball
    axis: int

    def terms(self, angle: Ball) -> list[Ball]:
        """Return its energy and the derivatives up to order 3; no numbers beyond its end."""
        kind = barrier if self.axis == 1 else outer_barrier
        return kind(self.stiffness, angle)

    def end_beyond(self, slope: Ball) -> float | None:
        """Return an angle from which on, up to its end, its slope exceeds another, or None.

        With t = tan θ2 the slope k t (1 + t²) exceeds k t³, and grows. With θ/2 it is half of that.
        """
        share = 1 if self.axis == 1 else 2
        steep = share * slope / self.stiffness
        angle = share * (float(((1 + steep).root(3)).atan()) + 1e-9)
        # A double beyond the end has no bounds, and no comparison with them is true.
        return angle if self.terms(arb(angle))[1] > slope else None


def barriers_of(data: Mapping[str, Any]) -> list[Barrier]:
    """Return the barriers of `reduced_energy` of a proof.

    Raises:
        ValueError: One has a stiffness that is not positive.
    """
    stiffness, outer = data.get("barrier"), data.get("outer_barrier")
    given = [(stiffness, 1), (outer, 0), (outer, 2)]
    if any(one is not None and not one > 0 for one, _ in given):
        raise ValueError("The barrier has a stiffness that is not positive")
    return [Barrier(rounded(one), axis) for one, axis in given if one is not None]


class SwitchingGuard:
    """A guard with the slope K + k (|θ2| - θ_s) toward the inside, beyond its angle θ_s alone.

    At θ_s itself any couple between 0 and K may act. That of a stop has no bound, and it allows no
    |θ2| above θ_s.

    Attributes:
        couple: K, a ball, N m; None for a stop.
        stiffness: k, a ball, N m/rad.
        angle: θ_s, a ball, rad.

    Raises:
        ValueError: It acts outwards, or its angle is not between 0 and π/2.
    """

    def __init__(self, couple: float | None, stiffness: float, angle: float) -> None:
        outwards = stiffness < 0 or (couple is not None and couple < 0)
        if outwards or not (arb(angle) > 0 and arb(angle) < arb.pi() / 2):
            raise ValueError("A guard acts outwards, or not between 0 and π/2")
        self.couple = None if couple is None else rounded(couple) if couple > 0 else arb(0)
        self.stiffness = rounded(stiffness) if stiffness > 0 else arb(0)
        self.angle = rounded(angle)

    def energy(self, angle: Ball) -> Ball:
        """Return the energies for a ball of θ2, J."""
        excess = (abs(angle) - self.angle).max(arb(0))
        couple = arb(0) if self.couple is None else self.couple
        return couple * excess + self.stiffness * square(excess) / 2

    def slope(self, angle: Ball) -> Ball:
        """Return the slopes for a ball of θ2, J/rad: one by one, and all between; no stop."""
        above, below = self._beyond(angle), self._beyond(-angle)
        return above - below

    def curvature(self, angle: Ball) -> Ball:
        """Return the second derivatives for a ball of θ2, but for those at a jump of the slope."""
        size = abs(angle)
        if size > self.angle:
            return self.stiffness
        return arb(0) if size < self.angle else self.stiffness.union(arb(0))

    def touched(self, angle: Ball) -> bool:
        """Return whether a ball of θ2 may contain θ_s or -θ_s."""
        return bool(angle.overlaps(self.angle)) or bool(angle.overlaps(-self.angle))

    def jumps(self, angle: Ball) -> bool:
        """Return whether the slope may jump in a ball of θ2."""
        return (self.couple is None or self.couple != 0) and self.touched(angle)

    def _beyond(self, angle: Ball) -> Ball:
        """Return the slopes for a ball of θ2 that come from θ2 > θ_s."""
        assert self.couple is not None
        if angle < self.angle:
            return arb(0)
        found = self.couple + self.stiffness * (angle - self.angle).max(arb(0))
        return found if angle > self.angle else found.union(arb(0))


def switching_guards(data: Mapping[str, Any]) -> list[SwitchingGuard]:
    """Return the soft guards of `reduced_energy` of a proof, and the stop, the last one."""
    found = [
        SwitchingGuard(one["couple"], one["stiffness"], one["soft_angle"])
        for one in data.get("soft_guards") or ()
    ]
    stop = data.get("stop")
    return found if stop is None else [*found, SwitchingGuard(None, 0.0, stop)]
