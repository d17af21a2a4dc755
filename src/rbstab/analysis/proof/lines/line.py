"""The length of a line as a part of a reduced energy: w √s(Θ), with s a form without a quadratic.

An element along a line has an energy in which the length ℓ = √(e'e) may stand without a square,
as -k ℓ₀ ℓ in that of a spring. e'e is a trigonometric polynomial s if the body is held.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rbstab.analysis.proof.lines.intervals import Intervals, between, near, total
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.analysis.proof.trigonometric import Derivatives, TrigonometricForm

SLOPE_OF_ROOT = 1 + 1e-12
"""A factor that exceeds the rounding errors of the bounds on the first derivatives."""


@dataclass(frozen=True, eq=False)
class Line:
    """The energy w √s of a line, J, with proved bounds on its derivatives.

    Args:
        weight: w, N, an exact number rounded once.
        square: s, m², periodic, without multiples of an angle.
        least: A proved lower bound on s at all real Θ, above 0 (`shortest.line_of`).
    """

    weight: float
    square: "TrigonometricForm"
    least: float

    def approximate(self, Theta: Array, order: int) -> list[Array]:
        """Return the derivatives of order 0 to `order` (at most 2) at points, to round-off."""
        s = self.square.approximate(Theta, order)
        root = np.sqrt(s[0])
        found = [self.weight * root]
        if order > 0:
            slope = s[1] / (2 * root[:, np.newaxis])
            found.append(self.weight * slope)
        if order > 1:
            bend = 0.5 * s[2] - np.einsum("mi,mj->mij", slope, slope)
            found.append(self.weight * bend / root[:, np.newaxis, np.newaxis])
        return found

    def at(self, Theta: Array, order: int) -> list[Intervals]:
        """Return proved bounds on the derivatives of order 0 to `order` at points.

        Args:
            Theta: The points, shape (m, 3).
            order: At most 3.

        Returns:
            Intervals of shapes (m,), (m, 3), (m, 3, 3) and (m, 3, 3, 3).
        """
        s = self.square
        return self.of_square([known(one) for one in s.derivatives(s.basis(Theta), Theta, order)])

    def of_square(self, s: Sequence[Intervals]) -> list[Intervals]:
        """Return bounds on the derivatives of w √s from those of s, of order 0 to at most 3.

        With f = √s and its derivatives f′, f″, f‴ by s:

            ∂f/∂θ_i = f′s_i        ∂²f/∂θ_i∂θ_j = f′s_ij + f″s_i s_j
            ∂³f/∂θ_i∂θ_j∂θ_k = f′s_ijk + f″(s_ij s_k + s_ik s_j + s_jk s_i) + f‴s_i s_j s_k
        """
        weight = near(self.weight)
        value = between(np.maximum(s[0].low, self.least), np.maximum(s[0].high, self.least))
        found = [weight * value.root()]
        if len(s) > 1:
            first = (near(0.5) * weight * value.negative_power(1))[:, np.newaxis]
            a = s[1]
            found.append(first * a)
        if len(s) > 2:
            second = (near(-0.25) * weight * value.negative_power(3))[:, np.newaxis, np.newaxis]
            first, b = first[..., np.newaxis], s[2]
            pairs = a[:, :, np.newaxis] * a[:, np.newaxis, :]
            found.append(first * b + second * pairs)
        if len(s) > 3:
            third = near(0.375) * weight * value.negative_power(5)
            third = third[:, np.newaxis, np.newaxis, np.newaxis]
            first, second = first[..., np.newaxis], second[..., np.newaxis]
            mixed = total(
                [
                    b[:, :, :, np.newaxis] * a[:, np.newaxis, np.newaxis, :],
                    b[:, :, np.newaxis, :] * a[:, np.newaxis, :, np.newaxis],
                    b[:, np.newaxis, :, :] * a[:, :, np.newaxis, np.newaxis],
                ]
            )
            cubes = pairs[..., np.newaxis] * a[:, np.newaxis, np.newaxis, :]
            found.append(total([first * s[3], second * mixed, third * cubes]))
        return found

    @cached_property
    def steepest(self) -> Array:
        """Bounds on |∂(w √s)/∂θ_i| at any point, shape (3,), J/rad (proofs.md, lemma 7)."""
        slopes = self.square.trigonometric_bound(1)
        return abs(self.weight) * np.sqrt(0.5 * slopes) * SLOPE_OF_ROOT

    @cached_property
    def largest(self) -> float:
        """A bound on |w √s| at any point, J."""
        most = float(self.square.trigonometric_bound(0))
        return abs(self.weight) * float(np.sqrt(most)) * SLOPE_OF_ROOT

    @cached_property
    def noise(self) -> tuple[float, Array]:
        """The size of round-off in the energy, J, and in its slopes, shape (3,); not proved."""
        value, slope = self.square.round_off[:2]
        weight, root = abs(self.weight), np.sqrt(self.least)
        at_value = weight * float(value) / (2 * root) + 1e-15 * self.largest
        at_slope = weight * slope / (2 * root) + self.steepest * (value / self.least + 1e-15)
        return float(at_value), at_slope


def known(found: "Derivatives") -> Intervals:
    """Return derivatives at points with their errors as intervals."""
    return Intervals(found.values, np.broadcast_to(found.error, found.values.shape))
