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

RADII = np.geomspace(1e-12, 2.0, 120)
"""The radii of the boxes about a point on which convexity is tried."""


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
    H0, others, error = at_point.curvature()
    bound = lower_bound(H0, others, error)
    if bound is None:
        return None
    F, size = bound.factor, np.abs(bound.factor)
    lo, hi = point[:, None] - RADII, point[:, None] + RADII
    change = family.over(lo, hi).change
    # The norm of F C F' is at most the largest sum of a row of |F| |C| |F'|.
    sums = np.einsum("ka,abm,lb->klm", size, change, size).sum(axis=1)
    least = np.nextafter(bound.least - sums.max(axis=0) * UP, -np.inf)
    slope = np.array([sum(np.abs(x[0]) for x in at_point.along(y[:, None])) for y in F])
    # A point of the ball is off by F'y: by at most the norm of a row of F' times |y|.
    rows = np.sqrt(np.sum(F**2, axis=0))
    reach = rows[:, None] * np.sqrt(np.sum(slope**2)) * UP / least * UP
    inner = np.minimum(hi - point[:, None], point[:, None] - lo)
    convex = least > 0
    inside = np.flatnonzero(np.all(reach < np.nextafter(inner, -np.inf), axis=0) & convex)
    if not len(inside):
        return None
    first, last = inside[0], np.flatnonzero(convex)[-1]
    return Minimum(point, Box(lo[:, first], hi[:, first]), Box(lo[:, last], hi[:, last]))
