"""Check a rest state at which a guard holds θ2: at the angle where the slope of its energy jumps.

F is U without this guard, and s = 1 at θ2 = θ_s, s = -1 at θ2 = -θ_s. The state is at rest where
∂F/∂θ1 = ∂F/∂θ3 = 0 and the guard can balance the rest: 0 <= -s ∂F/∂θ2 <= K, for a stop without K.
"""

from functools import cache
from typing import Any, NamedTuple

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import Box
from rbstab.analysis.proof_check.claims import RestState, fault_of
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.findings import Range
from rbstab.analysis.proof_check.guards import SwitchingGuard
from rbstab.analysis.proof_check.taylor import Taylor
from rbstab.analysis.proof_check.trigonometric import Ball, square

FREE = (0, 2)
"""θ1 and θ3 among the axes."""


class Holder(NamedTuple):
    """The guard that holds a rest state, and s.

    Attributes:
        guard: The guard.
        side: s.
    """

    guard: SwitchingGuard
    side: int

    @property
    def angle(self) -> Ball:
        """The exact θ2, a ball."""
        return self.side * self.guard.angle

    def balances(self, slope: Ball) -> bool:
        """Return whether it balances ∂F/∂θ2, with some couple left over."""
        pressing = -self.side * slope
        return bool(pressing > 0) and (self.guard.couple is None or pressing < self.guard.couple)


def is_at_guard(U: Energy, state: RestState) -> bool:
    """Return whether the enclosure of a rest state contains the angle of a guard that jumps."""
    return _holder(U, state.enclosure) is not None


def held_fault(U: Energy, state: RestState, range_: Range) -> str | None:
    """Return what is wrong with a rest state that is held."""
    holder = _holder(U, state.enclosure)
    if holder is None:
        return "no guard holds θ2 in its enclosure"
    plane = cache(lambda: Taylor(U, state.enclosure, (1, holder.angle), holder.guard))
    return fault_of(
        state,
        range_,
        unique=lambda: held_unique(U, state, state.enclosure),
        exists=lambda: _exists(plane(), state.enclosure),
        index=lambda: _index_along(plane().hessian),
    )


def held_unique(U: Energy, state: RestState, box: Box) -> bool:
    """Return whether a box has at most one rest state, as it would be held.

    In all of it the guard balances ∂F/∂θ2 at its angle, so nothing is at rest at other θ2. At its
    angle, ∂F/∂θ1 and ∂F/∂θ3 are one to one: |I - YH| has a norm below 1.
    """
    holder = _holder(U, state.enclosure)
    if holder is None:
        return False
    plane = Taylor(U, box, (1, holder.angle), holder.guard)
    residual = _residual(plane)
    if residual is None:
        return False
    sums = (residual[i, 0].abs_upper() + residual[i, 1].abs_upper() for i in range(2))
    if not all(total < 1 for total in sums):
        return False
    return holder.balances(Taylor(U, box, without=holder.guard).whole_gradient[1, 0])


def _holder(U: Energy, box: Box) -> Holder | None:
    """Return the only guard whose slope jumps in an enclosure; None without one."""
    pitch = arb(box[1][0]).union(arb(box[1][1]))
    jumping = [one for one in U.guards if one.jumps(pitch)]
    if len(jumping) != 1:
        return None
    side = 1 if pitch > 0 else -1
    angle, (low, high) = side * jumping[0].angle, box[1]
    return Holder(jumping[0], side) if arb(low) < angle < arb(high) else None


def _exists(plane: Taylor, box: Box) -> bool:
    """Return whether Krawczyk's test finds a zero of ∂F/∂θ1 and ∂F/∂θ3 at the angle of the guard.

    That the guard balances the rest there is part of `held_unique`.
    """
    residual, Y = _residual(plane), _inverse(plane)
    if residual is None:
        return False
    step = arb_mat([[plane.step[i, 0]] for i in FREE])
    gradient = arb_mat([[plane.gradient[i, 0]] for i in FREE])
    image = residual * step - Y * gradient
    found = [plane.centre[axis] + image[i, 0] for i, axis in enumerate(FREE)]
    ends = [box[axis] for axis in FREE]
    return all(arb(low) < angle < arb(high) for (low, high), angle in zip(ends, found, strict=True))


def _block(matrix: Any) -> Any:
    """Return the part of a matrix that belongs to θ1 and θ3."""
    return arb_mat([[matrix[i, j] for j in FREE] for i in FREE])


def _inverse(plane: Taylor) -> Any:
    """Return a matrix Y near the inverse of the Hessian by θ1 and θ3; None if there is none."""
    try:
        inverse = _block(plane.hessian).mid().inv().mid()
    except ZeroDivisionError:
        return None
    return inverse if all(entry.is_finite() for entry in inverse.entries()) else None


def _residual(plane: Taylor) -> Any:
    """Return I - YH by θ1 and θ3 over a box; None if Y does not exist."""
    Y = _inverse(plane)
    unit = arb_mat([[arb(int(i == j)) for j in range(2)] for i in range(2)])
    return None if Y is None else unit - Y * _block(plane.whole_hessian)


def _index_along(H: Any) -> int | None:
    """Return the number of negative eigenvalues of the Hessian by θ1 and θ3; None if not known."""
    return index_of_two(H[0, 0], H[0, 2], H[2, 2])


def index_of_two(a: Ball, b: Ball, c: Ball) -> int | None:
    """Return the number of negative eigenvalues of [[a, b], [b, c]]; None if not known."""
    determinant = a * c - square(b)
    if determinant < 0:
        return 1
    if determinant > 0 and a > 0:
        return 0
    return 2 if determinant > 0 and a < 0 else None
