"""The energy along θ2, at its least over θ1 and θ3: a computed curve for figures, not a proof."""

from dataclasses import replace

import numpy as np

from rbstab.analysis.proof.boxes import RANGE_END
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.proof.unwrapped import unwrapped_end
from rbstab.mechanics.numbers import Array

GRID = 25
"""Points of θ1, and of θ3, from which the lowest one is taken for each θ2."""

WIDEST = 15.0
"""rad: the grid ends here, also where the least energy may lie beyond."""

INNER = 3.1
"""rad: barriers on θ1 and θ3 keep them within ±π; the grid ends before."""

STEPS = 20
"""Newton steps from the lowest point of the grid."""

OUTER = np.array([0, 2])
"""θ1 and θ3 among the angles."""


@np.errstate(all="ignore")  # near ±π/2 the energy of a barrier overflows
def least_along_pitch(form: TrigonometricForm, pitch: Array) -> Array:
    """Return the least U over all real θ1 and θ3 for each θ2, J; infinite beyond a stop.

    Args:
        form: U.
        pitch: θ2, shape (m,), rad, between -π/2 and π/2.
    """
    outer = None if form.guard is None else form.guard.outer
    bound = unwrapped_end(form) if outer is None else np.array([INNER, INNER, INNER])
    end = np.minimum(RANGE_END if bound is None else bound, WIDEST)
    # Guards of θ2 do not depend on θ1 and θ3.
    bare = form.unguarded if outer is None else replace(form, guard=Guard(outer=outer))
    first, third = (np.linspace(-end[axis], end[axis], GRID) for axis in OUTER)
    grid = np.stack(np.meshgrid(pitch, first, third, indexing="ij"), axis=-1)
    Theta = grid[..., [1, 0, 2]].reshape(-1, 3)
    lowest = bare.value(Theta).reshape(len(pitch), -1).argmin(axis=1)
    Theta = Theta.reshape(len(pitch), -1, 3)[np.arange(len(pitch)), lowest]
    least = _descended(bare, Theta)
    if form.guard is None:
        return least
    added = form.guard.approximate(pitch, 0)[0]
    return np.where(np.abs(pitch) <= form.guard.end, least + added, np.inf)


def _descended(form: TrigonometricForm, Theta: Array) -> Array:
    """Return the values at the ends of descents in θ1 and θ3, by Newton's method, shape (m,)."""
    value, length = form.value(Theta), np.ones(len(Theta))
    for _ in range(STEPS):
        _, gradient, hessian = form.approximate(Theta, 2)
        block = hessian[:, OUTER[:, np.newaxis], OUTER]
        values, vectors = np.linalg.eigh(block)
        along = np.einsum("mji,mj->mi", vectors, gradient[:, OUTER])
        # Where the energy is not convex, the size of its curvature still gives a way down.
        sizes = np.abs(values)
        least = np.maximum(1e-12 * sizes.max(axis=1, keepdims=True), np.finfo(float).tiny)
        step = np.einsum("mij,mj->mi", vectors, along / np.maximum(sizes, least))
        moved = Theta.copy()
        moved[:, OUTER] -= length[:, np.newaxis] * step
        found = form.value(moved)
        lower = found < value
        Theta = np.where(lower[:, np.newaxis], moved, Theta)
        value = np.where(lower, found, value)
        length = np.where(lower, 1.0, 0.5 * length)
    return value
