"""Families of rest states: a continuum of zeros of ∇U. At each of them its Hessian is singular."""

from collections.abc import Sequence

import numpy as np

from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

SINGULAR = 1e-6
"""A smaller eigenvalue of a Hessian, relative to the largest, is taken for zero."""

APART = 1e-3
"""rad: two singular zeros that are closer may be one, found twice to a few digits."""

ENOUGH = 12
"""So many singular zeros apart are taken for a family. A pitchfork, for example, has one."""

AT_POLE = 1e-6
"""rad: a zero so close to θ2 = ±π/2 is taken for one at it."""

OPEN_PITCH = np.pi / 2 - AT_POLE


def singular(hessians: Array, least: Array | float = SINGULAR) -> Array:
    """Return whether Hessians have an eigenvalue below `least` times the largest, shape (m,)."""
    finite = np.all(np.isfinite(hessians), axis=(1, 2))
    sizes = np.abs(np.linalg.eigvalsh(np.where(finite[:, None, None], hessians, 0.0)))
    found: Array = finite & (sizes.min(axis=1) <= least * sizes.max(axis=1))
    return found


def without_family(form: TrigonometricForm, points: Sequence[Array]) -> list[Array]:
    """Return those of some zeros at which the Hessian is regular."""
    return [point for point in points if not singular(form.approximate(point[None], 2)[2])[0]]


def is_family(form: TrigonometricForm, points: Sequence[Array]) -> bool:
    """Return whether points at which ∇U is zero seem to be a family: it is not proved."""
    if len(points) < ENOUGH:
        return False
    zeros = np.array(points)
    # At θ2 = ±π/2 the angles themselves are singular.
    zeros = zeros[(np.abs(zeros[:, 1]) < OPEN_PITCH)]
    zeros, count = zeros[singular(form.approximate(zeros, 2)[2])], 0
    while len(zeros) and count < ENOUGH:
        zeros = zeros[np.abs(zeros - zeros[0]).max(axis=1) > APART]
        count += 1
    return count >= ENOUGH
