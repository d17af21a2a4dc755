"""The one minimum of each body near a point, by convexity.

With a matrix F near the inverse of the Cholesky factor of ∇²U of the middle body, F∇²U F' >= μ at
the point for all bodies (`majorants`). Over a box it is at least μ - τ; third derivatives bound τ.
"""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box
from rbstab.proof.enclosures.bounds import UP
from rbstab.proof.robust.family import Family
from rbstab.proof.robust.majorants import lower_bound
from rbstab.proof.zeros import followed

RADII = np.geomspace(1e-10, 2.0, 120)
"""The radii of the boxes about a point on which convexity is tried."""

NEWTON_STEPS = 40

ARRIVED = 1e-12
"""A shorter step of Newton's method has arrived."""


class Minimum(NamedTuple):
    """The rest states of all bodies near a point.

    Attributes:
        point: The point, shape (3,), rad.
        enclosure: A box that contains one rest state of each body, a strict minimum.
        domain: A box in which no body has another.
    """

    point: Array
    enclosure: Box
    domain: Box


def lowest_near(family: Family, starts: Array) -> Array:
    """Follow Newton's method for the body in the middle to a minimum.

    Args:
        family: The energies.
        starts: Points, shape (3, points), rad. Most often the first leads to a minimum; the others
            are followed if it does not.

    Returns:
        The minimum of the first start that leads to one; the first start if none does.
    """

    def slopes(x: Array) -> tuple[Array, Array]:
        at = family.over(x, x)
        return at.slope.middle, at.bend.middle[:, :3]

    def never(x: Array) -> Array:
        return np.zeros(x.shape[1], dtype=bool)

    for some in (starts[:, :1], starts[:, 1:]):
        x, last = followed(slopes, some, NEWTON_STEPS, never)
        for k in np.flatnonzero(last < ARRIVED):
            if np.linalg.eigvalsh(slopes(x[:, k : k + 1])[1][..., 0]).min() > 0:
                return x[:, k]
    return starts[:, 0]


@np.errstate(all="ignore")  # comparisons with NaN are false
def minimum_near(family: Family, point: Array) -> Minimum | None:
    """Prove that each body has one rest state near a point, a minimum.

    In y with Θ = Θ̂ + F'y, U has the gradient F∇U and, on a box that contains Θ̂, a Hessian of at
    least μ - τ. If the ball |y| <= |F∇U(Θ̂)|/(μ - τ) lies inside the box, U has a minimum in it. As
    U is strictly convex on the box, it is the only zero of ∇U there.

    Args:
        family: The energies.
        point: Θ̂, shape (3,), rad.
    """
    at_point = family.over(point[:, None], point[:, None])
    H = at_point.curvature()
    bound = lower_bound(H.middle, H.others, H.error)
    if bound is None:
        return None
    F, size = bound.factor, np.abs(bound.factor)
    lo, hi = point[:, None] - RADII, point[:, None] + RADII
    change = family.over(lo, hi).change
    # The norm of F C F' is at most the largest sum of a row of |F| |C| |F'|.
    sums = np.einsum("ka,abm,lb->klm", size, change, size).sum(axis=1)
    least = np.nextafter(bound.least - sums.max(axis=0) * UP, -np.inf)
    along = np.array([at_point.along(y[:, None]) for y in F])[..., 0]
    slope = np.abs(along[:, 0]) + along[:, 2]
    # A point of the ball is off by F'y: by at most the norm of a row of F' times |y|.
    rows = np.sqrt(np.sum(F**2, axis=0))
    reach = rows[:, None] * np.sqrt(np.sum(slope**2)) * UP / least * UP
    convex = least > 0
    # Less than the radii, as the ends of the boxes are rounded.
    inside = np.flatnonzero(np.all(reach < RADII * (1 - 1e-5), axis=0) & convex)
    if not len(inside):
        return None
    first, last = inside[0], np.flatnonzero(convex)[-1]
    return Minimum(point, Box(lo[:, first], hi[:, first]), Box(lo[:, last], hi[:, last]))
