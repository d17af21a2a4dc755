"""One zero of ∇V: Newton's method, and a proof that a box about its end has exactly one."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from rbstab.analysis.rest_state import in_order
from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box
from rbstab.proof.enclosures.bounds import (
    UP,
    BoundedEnergy,
    inverses,
    preconditioned,
)
from rbstab.proof.enclosures.index import proved_index

RADII = np.geomspace(1e-15, 2.0, 160)
"""The radii of the boxes about a point, of which one is proved to have a single zero."""


@dataclass(frozen=True, eq=False)
class Zero:
    """A zero of ∇V.

    Args:
        point: A point near it, shape (n,).
        enclosure: A box that contains exactly this zero.
        domain: A wider box in which there is no other.
        index: The number of negative eigenvalues of ∇²V there; None if it is not proved.
        energy: V near it, J.
        normal: Across the surface at which a force that jumps holds the body; None elsewhere.
        ridge: Whether this force pushes away.
    """

    point: Array
    enclosure: Box
    domain: Box
    index: int | None
    energy: float
    normal: Array | None = None
    ridge: bool = False


def ordered(zeros: Iterable[Zero]) -> tuple[Zero, ...]:
    """Return zeros, lowest energy first."""
    return tuple(in_order(zeros, lambda zero: (zero.energy, zero.point)))


def newton(
    energy: BoundedEnergy,
    starts: Array,
    steps: int = 30,
    arrived: Callable[[Array], Array] | None = None,
) -> tuple[Array, Array]:
    """Follow Newton's method from some points; return the ends and last steps.

    It moves in all variables at once, from where U is least over z. It ends when each point is at
    a zero, or where `arrived` says so.

    Args:
        energy: The energy.
        starts: The points, shape (n, points).
        steps: The most steps.
        arrived: Returns which of some points need no more steps, shape (points,); None: none.

    Returns:
        The ends, shape (n, points), and the sizes of the last steps, shape (points,).
    """
    z = energy.minimiser(starts).z if energy.k else np.zeros((0, starts.shape[1]))

    def slopes(x: Array) -> tuple[Array, Array]:
        return energy.at_all(x[: energy.n], x[energy.n :])[1:]

    def done(x: Array) -> Array:
        return arrived(x[: energy.n]) if arrived is not None else np.zeros(x.shape[1], dtype=bool)

    ends, last = followed(slopes, np.concatenate([starts, z]), steps, done)
    return ends[: energy.n], last


def followed(
    slopes: Callable[[Array], tuple[Array, Array]],
    x: Array,
    steps: int,
    done: Callable[[Array], Array],
) -> tuple[Array, Array]:
    """Follow Newton's method from points x with some slopes and second derivatives there.

    Args:
        slopes: Returns the slopes, shape (n, points), and the second derivatives, shape (n, n,
            points).
        x: The points, shape (n, points).
        steps: The most steps.
        done: Returns which of some points need no more steps, shape (points,).

    Returns:
        The ends, shape (n, points), and the sizes of the last steps, shape (points,).
    """
    last = np.full(x.shape[1], np.inf)
    with np.errstate(all="ignore"):
        for _ in range(steps):
            g, H = slopes(x)
            step, error = _newton_steps(H, g)
            last = np.maximum(np.abs(step).max(axis=0), error)
            step = step * np.minimum(1.0, 0.5 / np.maximum(last, 1e-300))
            x = x - np.where(np.isfinite(step), step, 0.0)
            left = last > 1e-13
            if not np.any(left) or not np.any(left & ~done(x)):
                break
    return x, last


def _newton_steps(H: Array, g: Array) -> tuple[Array, Array]:
    """Return H⁻¹g for each point, and 0; for a singular H the shortest step, and what it leaves."""
    step, left = np.einsum("ijm,jm->im", inverses(H), g), np.zeros(g.shape[1])
    finite = np.all(np.isfinite(H), axis=(0, 1)) & np.all(np.isfinite(g), axis=0)
    for k in np.flatnonzero(finite & ~np.all(np.isfinite(step), axis=0)):  # as in a family
        step[:, k] = np.linalg.pinv(H[:, :, k], hermitian=True) @ g[:, k]
        size = max(np.abs(H[:, :, k]).max(), 1e-300)
        left[k] = np.abs(H[:, :, k] @ step[:, k] - g[:, k]).max() / size
    return step, left


def isolated(energy: BoundedEnergy, point: Array) -> Zero | None:
    """Prove that there is exactly one zero near a point; None if no box about it shows this."""
    lo = np.nextafter(point[:, None] - RADII, -np.inf)
    hi = np.nextafter(point[:, None] + RADII, np.inf)
    b = energy.over(lo, hi)
    step, error, mean, hessian = preconditioned(b)
    unique = hessian.sum(axis=1).max(axis=0) * UP < 1
    with np.errstate(all="ignore"):
        # Krawczyk's operator maps a box with a zero into its inside.
        image = np.abs(step) + error + np.einsum("ijm,jm->im", mean, b.radius)
        inner = np.minimum(hi - b.centre, b.centre - lo)
        exists = np.all(image * UP < np.nextafter(inner, -np.inf), axis=0)
    both = np.flatnonzero(unique & exists)
    if not len(both):
        return None
    e, d = int(both[0]), int(np.flatnonzero(unique)[-1])
    return Zero(
        point,
        Box(lo[:, e], hi[:, e]),
        Box(lo[:, d], hi[:, d]),
        proved_index(b.hessian.mid[:, :, e], b.hessian.rad[:, :, e] * UP),
        float(b.value.mid[e]),
    )
