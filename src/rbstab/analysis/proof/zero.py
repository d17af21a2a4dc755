"""One zero of the gradient of a reduced energy, proved to exist and to be unique in a box."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.proof.box_bounds import inverses
from rbstab.analysis.proof.boxes import Boxes, box_around, joined
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.searches.families import singular
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

NEWTON_STEPS = 40
SHORT_NEWTON_STEPS = 12
"""The number of steps from a point that is near a zero, if there is one: a search tries again when
the boxes are smaller, and of most points that need more steps nothing comes."""

MAX_STEP = 0.5
"""rad: longer Newton steps are cut to this, because the linear model fails so far away."""

NO_CURVATURE = 1e-12
"""A smaller eigenvalue of a Hessian, relative to the largest, is zero to round-off."""

ALONG = 1e-9
"""A larger share of a gradient is one that no Newton step removes."""

RADII = np.geomspace(1e-15, 2.0, 200)
"""rad: the radii of the boxes that are tried about a zero, from round-off to most of the range."""


@dataclass(frozen=True, eq=False)
class Zero:
    """A zero of the gradient: exactly one is in `enclosure`, and no other one is in `domain`.

    Theta, shape (3,), rad, is the zero to round-off, and both boxes are around it. at_kink is
    whether it is held where a slope jumps: that of a guard of θ2 (`guards/kinks.py`), or of an
    element of a user (`traced/held.py`).
    """

    Theta: Array
    enclosure: Boxes
    domain: Boxes
    at_kink: bool = False

    @property
    def radius(self) -> float:
        """The largest distance of the zero from Theta along any axis, rad."""
        return float(self.enclosure.radius.max())

    def domain_contains(self, Theta: Array) -> bool:
        """Return whether a point is in the domain; then a zero at that point is this zero."""
        return bool(np.all((Theta >= self.domain.low) & (Theta <= self.domain.high)))

    def is_same_as(self, other: "Zero") -> bool | None:
        """Return whether this and another `Zero` are the same zero; None if undecided."""
        for small, large in ((self.enclosure, other.domain), (other.enclosure, self.domain)):
            if small.within(large)[0]:
                return True
        return None if self.enclosure.intersects(other.enclosure)[0] else False


@np.errstate(all="ignore")
def newton(
    form: TrigonometricForm, starts: Array, steps: int = NEWTON_STEPS
) -> tuple[Array, Array]:
    """Run Newton's method for ∇U = 0 from many points at once.

    Args:
        form: U.
        starts: Shape (m, 3), rad.
        steps: The largest number of steps.

    Returns:
        The end points, shape (m, 3), and the last steps, shape (m,), rad. The last step is
        round-off if the method has converged.
    """
    Theta = starts
    last = np.full(len(starts), np.inf)
    for _ in range(steps):
        _, gradient, hessian = form.approximate(Theta, 2)
        step = np.einsum("mkl,ml->mk", inverses(hessian), gradient)
        flat = singular(hessian, NO_CURVATURE)
        step[flat] = _shortest_steps(hessian[flat], gradient[flat])
        last = np.abs(step).max(axis=1)
        shortened = step * np.minimum(1.0, MAX_STEP / last)[:, np.newaxis]
        # At a zero the step may be 0/0; with a singular Hessian there may be none.
        Theta = Theta - np.where(np.isfinite(shortened), shortened, 0.0)
        if not np.any(last > 1e-13):
            break
    return Theta, last


def _shortest_steps(hessian: Array, gradient: Array) -> Array:
    """Return the Newton steps across a family of zeros, where the Hessian is singular, (m, 3).

    They are infinite where the gradient points along the family: then it is none.
    """
    inverse = np.linalg.pinv(hessian, rcond=NO_CURVATURE, hermitian=True)
    found: Array = np.einsum("mkl,ml->mk", inverse, gradient)
    left = np.abs(np.einsum("mkl,ml->mk", hessian, found) - gradient).max(axis=1)
    size = np.abs(gradient).max(axis=1) + 1e-6 * np.abs(hessian).max(axis=(1, 2))
    found[left > ALONG * size] = np.inf
    return found


def isolated_zero(form: TrigonometricForm, Theta: Array) -> Zero | None:
    """Prove that a zero near a point exists and is unique; return it, or None if the proof fails.

    Args:
        form: U.
        Theta: The end point of Newton's method, shape (3,), rad.
    """
    boxes = joined([box_around(Theta, radius) for radius in RADII])
    enclosed = enclosure(form, boxes)
    # All boxes have nearly the same Y: their centres differ only by rounding.
    bounds = enclosed.preconditioned(inverses(enclosed.hessian))
    at_most_one = bounds.at_most_one_zero
    exactly_one = np.flatnonzero(bounds.at_least_one_zero(boxes.inner_radius) & at_most_one)
    if not len(exactly_one):
        return None
    # The domain is the largest box proved to have no second zero.
    widest = np.flatnonzero(at_most_one)[-1]
    return Zero(Theta, boxes[exactly_one[:1]], boxes[widest : widest + 1])
