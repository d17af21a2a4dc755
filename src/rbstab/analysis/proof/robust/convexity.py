"""Convexity of all energies of a family on a box: then a minimum in it is the only rest state.

At a point, the Hessian of f_0 + Σ w_j f_j is at least S = H_0 - Σ M_j (as a quadratic form), for
all M_j with -M_j <= H_j <= M_j. If H_j has no negative eigenvalue, as that of a stiffness, M_j is
H_j. So a change of all stiffnesses by a half leaves half of H_0. Bounds on single entries fail.

With a matrix F near the inverse of the Cholesky factor of H_0, F S F' >= μ is proved in rational
numbers. Over a box, F H F' >= μ - τ; τ bounds the change of F H F' by the third derivatives.
"""

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from rbstab.analysis.proof.box_bounds import Enclosure
from rbstab.analysis.proof.boxes import ROUNDING_FACTOR, Boxes, box_around, joined
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.index import negative_eigenvalues
from rbstab.analysis.proof.robust.family import FormFamily
from rbstab.analysis.proof.zero import RADII, Zero
from rbstab.mechanics.numbers import Array

Rows = list[list[Fraction]]

GUESS = 1 - 1e-6
"""Factor on a computed eigenvalue, to get a bound that can be proved."""


@dataclass(frozen=True, eq=False)
class Curvature:
    """A lower bound of all Hessians of a family at a point: F H F' >= bound > 0, for all members.

    Theta is the point, shape (3,), rad.
    """

    Theta: Array
    factor: Array
    bound: float

    def over(self, boxes: Boxes, enclosed: Enclosure) -> Array:
        """Bound F H F' from below over each of m boxes that contain the point, shape (m,).

        |F| C |F'| bounds the change of F H F', if C bounds that of H. The largest sum of its rows
        bounds its norm.
        """
        distance = np.maximum(boxes.high - self.Theta, self.Theta - boxes.low)
        change = np.einsum("mkij,mi->mkj", enclosed.third, np.nextafter(distance, np.inf))
        size = np.abs(self.factor)
        sums = np.einsum("ka,mab,lb->mkl", size, change, size).sum(axis=2)
        return np.nextafter(self.bound - sums.max(axis=1) * ROUNDING_FACTOR, -np.inf)


def curvature_at(family: FormFamily, Theta: Array) -> Curvature | None:
    """Prove that the Hessians of all members are positive definite at a point.

    Args:
        family: The energies.
        Theta: The point, shape (3,), rad.

    Returns:
        The bound; None if some of them may not be positive definite.
    """
    middle, *others = family.hessians(Theta)
    try:
        factor = np.linalg.inv(np.linalg.cholesky(middle))
    except np.linalg.LinAlgError:
        return None
    if not np.all(np.isfinite(factor)):
        return None
    least = _rational(middle)
    # The errors of the computed Hessians: the norm is at most the largest sum of a row.
    error = Fraction(float(family.errors[2].sum(axis=0).sum(axis=1).max())) * 2
    for hessian in others:
        majorant, missing = _majorant(hessian)
        least = _sum(least, majorant, -1)
        error += missing
    least = [
        [entry - error * (i == j) for j, entry in enumerate(row)] for i, row in enumerate(least)
    ]
    F = _rational(factor)
    product = _product(_product(F, least), [list(column) for column in zip(*F, strict=True)])
    guess = float(np.linalg.eigvalsh(np.array([[float(x) for x in row] for row in product])).min())
    bound = guess * GUESS
    if not bound > 0 or not _at_least(product, Fraction(bound)):
        return None
    return Curvature(Theta, factor, bound)


def convex_on(family: FormFamily, box: Boxes) -> bool:
    """Return whether all energies of a family are proved to be strictly convex on a box."""
    curvature = curvature_at(family, box.centre[0])
    return curvature is not None and bool(curvature.over(box, enclosure(family, box))[0] > 0)


@np.errstate(all="ignore")  # comparisons with NaN are false
def isolated_minimum(family: FormFamily, Theta: Array) -> Zero | None:
    """Prove that each member has one rest state near a point; return where, or None.

    In y with Θ = Θ̂ + F'y, U has the gradient F∇U and, on a box that contains Θ̂, a Hessian of at
    least μ - τ. If the ball |y| <= |F∇U(Θ̂)|/(μ - τ) lies inside the box, U has a minimum in it.
    As U is strictly convex on the box, it is the only zero of ∇U there.

    Args:
        family: The energies.
        Theta: The end point of Newton's method, shape (3,), rad.

    Returns:
        The zeros: `enclosure` contains that of each member, and `domain` no other.
    """
    curvature = curvature_at(family, Theta)
    if curvature is None:
        return None
    boxes = joined([box_around(Theta, radius) for radius in RADII])
    least = curvature.over(boxes, enclosure(family, boxes))
    gradient = family.rigorous(Theta[np.newaxis], 1)[1]
    slope = np.abs(curvature.factor) @ (np.abs(gradient.values[0]) + gradient.error[0])
    # A point of the ball is off by F'y: by at most the norm of a row of F' times |y|.
    rows = np.sqrt(np.sum(curvature.factor**2, axis=0))
    reach = (
        rows * np.sqrt(np.sum(slope**2)) * ROUNDING_FACTOR / least[:, np.newaxis] * ROUNDING_FACTOR
    )
    inner = np.minimum(boxes.high - Theta, Theta - boxes.low)
    inside = np.all(reach < np.nextafter(inner, -np.inf), axis=1) & (least > 0)
    if not np.any(inside):
        return None
    first, last = np.flatnonzero(inside)[0], np.flatnonzero(least > 0)[-1]
    return Zero(Theta, boxes[first : first + 1], boxes[last : last + 1])


def _majorant(hessian: Array) -> tuple[Rows, Fraction]:
    """Return M and e with -M - e <= H <= M + e: M is near the absolute value of the matrix H."""
    values, vectors = np.linalg.eigh(hessian)
    majorant = (vectors * np.abs(values)) @ vectors.T
    M, H = _rational(0.5 * (majorant + majorant.T)), _rational(hessian)
    missing = Fraction(float(np.abs(values).max()) * 1e-13)
    while not (_at_least(_sum(M, H, -1), -missing) and _at_least(_sum(M, H, 1), -missing)):
        missing = 2 * missing + Fraction(1, 1 << 1000)
    return M, missing


def _at_least(rows: Rows, bound: Fraction) -> bool:
    """Return whether all eigenvalues of a symmetric matrix are proved to be above a bound."""
    shifted = [[x - bound * (i == j) for j, x in enumerate(row)] for i, row in enumerate(rows)]
    return negative_eigenvalues(shifted) == 0


def _rational(matrix: Any) -> Rows:
    return [[Fraction(entry) for entry in row] for row in matrix.tolist()]


def _sum(one: Rows, other: Rows, factor: int) -> Rows:
    return [
        [x + factor * y for x, y in zip(row, second, strict=True)]
        for row, second in zip(one, other, strict=True)
    ]


def _product(one: Rows, other: Rows) -> Rows:
    columns = list(zip(*other, strict=True))
    return [
        [sum((x * y for x, y in zip(row, column, strict=True)), Fraction(0)) for column in columns]
        for row in one
    ]
