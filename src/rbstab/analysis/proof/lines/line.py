"""An energy of a line as a part of a reduced energy: w √s(Θ), with s a form without a quadratic.

An element along a line has an energy in which the length ℓ = √(e'e) may stand without a square,
as -k ℓ₀ ℓ in that of a spring. e'e is a trigonometric polynomial s if the body is held.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.lines.intervals import Intervals, between, known, near, total
from rbstab.analysis.proof.lines.over_boxes import at_centres, over_boxes
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.analysis.proof.trigonometric import TrigonometricForm

SLOPE_OF_ROOT = 1 + 1e-12
"""A factor that exceeds the rounding errors of the bounds on the first derivatives."""


class LinePart:
    """A part of an energy, J, that comes from the lengths of lines, or from a formula of a user."""

    @property
    def periodic(self) -> bool:
        """Whether whole turns of θ1 and θ3 leave it as it is."""
        return True

    def smoothed(self, width: float) -> "LinePart":
        """Return an energy without kinks within half the width, J; itself if it has none."""
        return self

    @property
    def forms(self) -> "Sequence[TrigonometricForm]":
        """The forms from which it is computed."""
        raise NotImplementedError

    def approximate(self, Theta: Array, order: int) -> list[Array]:
        """Return the derivatives of order 0 to `order` (at most 2) at points, to round-off."""
        raise NotImplementedError

    def over(self, t: Array, boxes: Boxes) -> list[Intervals]:
        """Return proved bounds over boxes.

        Args:
            t: The basis of the forms at the centres.
            boxes: The boxes of Θ.

        Returns:
            The value, the slopes and the Hessian H at the centres, and T so that the Hessian over a
            box is within H ± Σ T r. H may be that over the box; then T is zero.
        """
        raise NotImplementedError

    def at(self, Theta: Array, order: int) -> list[Intervals]:
        """Return proved bounds on the derivatives of order 0 to `order` at points.

        Args:
            Theta: The points, shape (m, 3).
            order: At most 3.

        Returns:
            Intervals of shapes (m,), (m, 3), (m, 3, 3) and (m, 3, 3, 3).
        """
        raise NotImplementedError

    @property
    def steepest(self) -> Array:
        """Bounds on the magnitudes of the slopes at any point, shape (3,), J/rad."""
        raise NotImplementedError

    @property
    def largest(self) -> float:
        """A bound on the magnitude at any point, J."""
        raise NotImplementedError

    @property
    def noise(self) -> tuple[float, Array]:
        """The size of round-off in the energy, J, and in its slopes, shape (3,); not proved."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class LineEnergy(LinePart):
    """An energy G(s) of a line, J, where s is the square of its length, with proved bounds.

    Args:
        square: s(Θ), m², periodic, without multiples of an angle.
    """

    square: "TrigonometricForm"

    @property
    def forms(self) -> "Sequence[TrigonometricForm]":
        """s."""
        return (self.square,)

    def approximate(self, Theta: Array, order: int) -> list[Array]:
        """Return the derivatives of order 0 to `order` (at most 2) at points, to round-off."""
        s = self.square.approximate(Theta, order)
        G = self.computed(s[0], order)
        found = [G[0]]
        if order > 0:
            found.append(G[1][:, np.newaxis] * s[1])
        if order > 1:
            pairs = np.einsum("mi,mj->mij", s[1], s[1])
            first, second = (row[:, np.newaxis, np.newaxis] for row in G[1:3])
            found.append(first * s[2] + second * pairs)
        return found

    def over(self, t: Array, boxes: Boxes) -> list[Intervals]:
        """Return proved bounds over boxes: see `LinePart.over`."""
        s = at_centres(self.square, t, boxes)
        return [*self.of_square(s[:3]), self.of_square(over_boxes(s, boxes.radius))[3]]

    def at(self, Theta: Array, order: int) -> list[Intervals]:
        """Return proved bounds on the derivatives of order 0 to `order` at points."""
        s = self.square
        return self.of_square([known(one) for one in s.derivatives(s.basis(Theta), Theta, order)])

    def of_square(self, s: Sequence[Intervals]) -> list[Intervals]:
        """Return bounds on the derivatives of G(s) from those of s, of order 0 to at most 3.

        ∂G/∂θ_i = G′s_i        ∂²G/∂θ_i∂θ_j = G′s_ij + G″s_i s_j
        ∂³G/∂θ_i∂θ_j∂θ_k = G′s_ijk + G″(s_ij s_k + s_ik s_j + s_jk s_i) + G‴s_i s_j s_k
        """
        G = self.bounds(s[0], len(s) - 1)
        found = [G[0]]
        if len(s) > 1:
            first, a = G[1][:, np.newaxis], s[1]
            found.append(first * a)
        if len(s) > 2:
            first, b = first[..., np.newaxis], s[2]
            second = G[2][:, np.newaxis, np.newaxis]
            pairs = a[:, :, np.newaxis] * a[:, np.newaxis, :]
            found.append(first * b + second * pairs)
        if len(s) > 3:
            third = G[3][:, np.newaxis, np.newaxis, np.newaxis]
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

    def computed(self, square: Array, order: int) -> list[Array]:
        """Return G and its derivatives by s up to `order` (at most 2) at points, to round-off."""
        raise NotImplementedError

    def bounds(self, square: Intervals, order: int) -> list[Intervals]:
        """Return proved bounds on G and its derivatives by s up to `order` (at most 3)."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Line(LineEnergy):
    """The energy w √s of a line, J, with proved bounds on its derivatives.

    Args:
        weight: w, N, an exact number rounded once.
        least: A proved lower bound on s at all real Θ, above 0 (`shortest.line_of`).
    """

    weight: float
    least: float

    def computed(self, square: Array, order: int) -> list[Array]:
        """Return w √s, w/(2 √s) and -w/(4 s √s), to round-off."""
        root = np.sqrt(square)
        rows = [self.weight * root, 0.5 * self.weight / root, -0.25 * self.weight / (square * root)]
        return rows[: order + 1]

    def bounds(self, square: Intervals, order: int) -> list[Intervals]:
        """Return proved bounds on w √s and its derivatives by s up to `order` (at most 3)."""
        weight = near(self.weight)
        s = between(np.maximum(square.low, self.least), np.maximum(square.high, self.least))
        found = [weight * s.root()]
        for factor, exponent in ((0.5, 1), (-0.25, 3), (0.375, 5))[:order]:
            found.append(near(factor) * weight * s.negative_power(exponent))
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
