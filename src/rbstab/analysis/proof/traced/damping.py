"""Which motions the elements of users damp: those of which it is shown that no other one is free.

A dissipated power is never negative (`passive.py`). Where it is zero, each of its terms is, and so
the velocities of which they are squares and the like (`signs.py`).
"""

from collections.abc import Iterable
from typing import NamedTuple

from rbstab.analysis.proof.formulas.signs import Signs
from rbstab.analysis.proof.traced.tracing import Loss, TracedStatements


class Damping(NamedTuple):
    """Which velocities are zero where elements dissipate nothing.

    Attributes:
        turning: Whether Ω is.
        moving: Whether V is, where Ω = 0.
    """

    turning: bool
    moving: bool


NOTHING = Damping(turning=False, moving=False)


def damping_of(elements: Iterable[TracedStatements]) -> Damping:
    """Return which velocities some passive elements damp, each by itself."""
    turning = moving = False
    for one in elements:
        turning = turning or _vanishes(one.loss)
        still = one.loss_without_turning
        moving = moving or (still is not None and _vanishes(still))
    return Damping(turning, moving)


def _vanishes(loss: Loss) -> bool:
    """Return whether the velocity of a dissipated power is shown to be zero where that is."""
    vanishing = Signs(loss.operations).vanishing(loss.result)
    return any(vanishing.issuperset(velocity) for velocity in loss.velocities)
