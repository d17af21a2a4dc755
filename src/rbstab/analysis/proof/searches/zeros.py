"""A search for zeros of the gradient of a reduced energy, by Newton's method from many starts."""

import numpy as np

from rbstab.analysis.proof.boxes import RANGE_END
from rbstab.analysis.proof.guards.kinks import kinks_of, newton_at_kink
from rbstab.analysis.proof.searches.families import OPEN_PITCH
from rbstab.analysis.proof.traced.held import surfaces
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.proof.zero import newton
from rbstab.mechanics.numbers import Array

STARTS = 1000
CONVERGED_STEP = 1e-9
"""rad: Newton's method has converged if its last step is below this.

One more step would then reach round-off.
"""

TURN = 2 * np.pi

MERGE_DISTANCE = 3e-4
"""rad: results closer than this count as one zero. The proof makes no such assumption.

At a threefold zero, where a rest state is about to split into three, the gradient is below
round-off within a distance of 1e-4.
"""


@np.errstate(all="ignore")  # comparisons with NaN are false
def search(
    form: TrigonometricForm, seed: int = 0, starts: int = STARTS, end: Array = RANGE_END
) -> Array:
    """Return the zeros of ∇U with |Θ| < end that Newton's method reaches.

    Args:
        form: U.
        seed: Seed of the random starts, which are uniform over the range; Θ = 0 is added.
        starts: Number of random starts.
        end: The largest |Θ|, shape (3,), rad; by default that of eq. 5. Zeros at θ2 = ±π/2 are left
            out: there ∂U/∂Θ is zero also where the couple on the body is not.

    Returns:
        The zeros, to round-off, shape (n, 3), rad, from the lowest energy to the highest. Of those
        that differ by whole turns, if these leave U as it is, there is one.
    """
    random = np.random.default_rng(seed).uniform(-end, end, size=(starts, 3))
    end = np.minimum(end, [np.inf, OPEN_PITCH, np.inf])
    points = np.concatenate([np.zeros((1, 3)), random])
    Theta, last = newton(form, points)
    at_round_off = np.abs(form.approximate(Theta, 1)[1]) <= form.noise[1]
    inside = np.all(np.abs(Theta) < end, axis=1)
    converged = inside & ((last < CONVERGED_STEP) | np.all(at_round_off, axis=1))
    on_kinks = [newton_at_kink(form, kink, points) for kink in kinks_of(form.guard)]
    on_kinks += [surface.newton(points) for surface in surfaces(form)]
    for held, step in on_kinks:
        inside = np.all(np.abs(held) < end, axis=1)
        Theta, last = np.concatenate([Theta, held]), np.concatenate([last, step])
        converged = np.concatenate([converged, inside & (step < CONVERGED_STEP)])
    # If several results count as one zero, keep the result with the shortest last step.
    order = np.argsort(last[converged])
    distinct = _distinct(Theta[converged][order], wraps=form.wraps)
    return distinct[np.argsort(form.value(distinct))]


def _distinct(points: Array, *, wraps: bool) -> Array:
    kept: list[Array] = []
    while len(points):
        kept.append(points[0])
        distance = points - points[0]
        if wraps:
            distance -= TURN * np.round(distance / TURN)
        points = points[np.abs(distance).max(axis=1) > MERGE_DISTANCE]
    return np.array(kept).reshape(-1, 3)
