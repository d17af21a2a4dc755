"""Zeros of the gradient of a reduced energy, looked for from many starts."""

import numpy as np

from rbstab.analysis.proof.boxes import RANGE_END
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.proof.zero import newton
from rbstab.mechanics.numbers import Array

STARTS = 1000
ARRIVED = 1e-9
"""rad: the last Newton step where one has arrived. From there it falls to round-off at once."""

APART = 3e-4
"""rad: arrivals closer than this are taken for one zero, which the proof does not do. At a
threefold zero, where a rest state is about to part into three, the gradient is round-off from 1e-4
on."""


@np.errstate(all="ignore")  # no test holds for what is not a number
def search(form: TrigonometricForm, seed: int = 0, starts: int = STARTS) -> Array:
    """The zeros of ∇U in the open range of eq. 5 that Newton's method reaches.

    Args:
        form: U.
        seed: Of the random starts, which are uniform over the range; Θ = 0 is one more.
        starts: Their number.

    Returns:
        The zeros, to round-off, shape (n, 3), rad, from the lowest energy to the highest.
    """
    random = np.random.default_rng(seed).uniform(-RANGE_END, RANGE_END, size=(starts, 3))
    points = np.concatenate([np.zeros((1, 3)), random])
    Theta, last = newton(form, points)
    balanced = np.abs(form.to_round_off(Theta, 1)[1]) <= form.round_off[1]
    inside = np.all(np.abs(Theta) < RANGE_END, axis=1)
    arrived = inside & ((last < ARRIVED) | np.all(balanced, axis=1))
    # Of those that are taken together the one whose last step was the shortest is kept.
    order = np.argsort(last[arrived])
    distinct = _distinct(Theta[arrived][order])
    return distinct[np.argsort(form.value(distinct))]


def _distinct(points: Array) -> Array:
    kept: list[Array] = []
    while len(points):
        kept.append(points[0])
        points = points[np.abs(points - points[0]).max(axis=1) > APART]
    return np.array(kept).reshape(-1, 3)
