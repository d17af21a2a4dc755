"""One zero of the gradient of a reduced energy, proved to exist and to be alone."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.proof.boxes import Boxes, box_around, joined
from rbstab.analysis.proof.enclosure import enclosure, inverses
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

NEWTON_STEPS = 40
MAX_STEP = 0.5
"""rad: longer Newton steps are cut to this, for beyond it the gradient has changed its course."""

REACHES = np.geomspace(1e-15, 2.0, 200)
"""rad: the sizes of boxes about a zero that are tried, from round-off to most of the range."""


@dataclass(frozen=True, eq=False)
class Zero:
    """A zero of the gradient: exactly one is in `enclosure`, and no other one is in `domain`.

    Theta, shape (3,), rad, is the zero to round-off; both boxes are about it.
    """

    Theta: Array
    enclosure: Boxes
    domain: Boxes

    @property
    def radius(self) -> float:
        """How far the zero can be from Theta along each axis, rad."""
        return float(self.enclosure.reach.max())

    def owns(self, Theta: Array) -> bool:
        """Whether a point is in the domain, so that a zero there is this one."""
        return bool(np.all((Theta >= self.domain.low) & (Theta <= self.domain.high)))

    def is_the_same_as(self, other: "Zero") -> bool | None:
        """Whether two proofs speak of one zero; None where that cannot be told."""
        for small, large in ((self.enclosure, other.domain), (other.enclosure, self.domain)):
            if small.within(large)[0]:
                return True
        return None if self.enclosure.meets(other.enclosure)[0] else False


@np.errstate(all="ignore")
def newton(form: TrigonometricForm, starts: Array) -> tuple[Array, Array]:
    """Newton's method for ∇U = 0 from many points at once.

    Args:
        form: U.
        starts: Shape (m, 3), rad.

    Returns:
        Where it ended, shape (m, 3), and the last step, shape (m,), rad, which is round-off where
        it arrived.
    """
    Theta = starts
    last = np.full(len(starts), np.inf)
    for _ in range(NEWTON_STEPS):
        _, gradient, hessian = form.to_round_off(Theta, 2)
        step = np.einsum("mkl,ml->mk", inverses(hessian), gradient)
        last = np.abs(step).max(axis=1)
        shortened = step * np.minimum(1.0, MAX_STEP / last)[:, np.newaxis]
        # At a zero the step may be 0/0; a singular Hessian leads nowhere.
        Theta = Theta - np.where(np.isfinite(shortened), shortened, 0.0)
        if not np.any(last > 1e-13):
            break
    return Theta, last


def isolated_zero(form: TrigonometricForm, Theta: Array) -> Zero | None:
    """The zero near a point with the proof that it is one, or None where that fails.

    Args:
        form: U.
        Theta: Where Newton's method arrived, shape (3,), rad.
    """
    boxes = joined([box_around(Theta, reach) for reach in REACHES])
    over = enclosure(form, boxes)
    # One Y for all sizes: H is that at Theta, but for the rounding of the boxes' centres.
    bounds = over.preconditioned(inverses(over.hessian))
    alone = bounds.one_at_most
    tight = np.flatnonzero(bounds.one_at_least & alone)
    if not len(tight):
        return None
    # The domain is the largest box up to which all are free of a second zero.
    widest = np.flatnonzero(alone)[-1]
    return Zero(Theta, boxes[tight[:1]], boxes[widest : widest + 1])
