"""The energy of a ligament of a held body as a part of a reduced energy."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbstab.analysis.proof.ligaments.law import LigamentEnergy
from rbstab.analysis.proof.lines.intervals import Intervals, exact
from rbstab.analysis.proof.lines.line import SLOPE_OF_ROOT, LineEnergy
from rbstab.mechanics.numbers import Array


@dataclass(frozen=True, eq=False)
class LigamentLine(LineEnergy):
    """The energy of a ligament, J, with proved bounds on its derivatives.

    A ligament is slack where it is short, so it may have no length: s may be zero.

    Args:
        law: G(s).
    """

    law: LigamentEnergy

    def computed(self, square: Array, order: int) -> list[Array]:
        """Return G and its derivatives by s up to `order` (at most 2) at points, to round-off."""
        return self.law.at(np.maximum(square, 0.0))[: order + 1]

    def bounds(self, square: Intervals, order: int) -> list[Intervals]:
        """Return proved bounds on G and its derivatives by s up to `order` (at most 3)."""
        return self.law.bounds(square, order)

    @cached_property
    def _longest(self) -> Intervals:
        """A bound on s at any point, as an interval without width, shape (1,)."""
        most = np.array([float(self.square.trigonometric_bound(0))])
        return exact(most)

    @cached_property
    def steepest(self) -> Array:
        """Bounds on |∂G/∂θ_i| at any point, shape (3,), J/rad: the tension times lemma 7."""
        tension = 2 * self.bounds(self._longest, 1)[1].high * np.sqrt(self._longest.high)
        slopes = self.square.trigonometric_bound(1)
        found: Array = tension * np.sqrt(0.5 * slopes) * SLOPE_OF_ROOT
        return found

    @cached_property
    def largest(self) -> float:
        """A bound on G at any point, J."""
        return float(self.bounds(self._longest, 0)[0].high[0])

    @cached_property
    def noise(self) -> tuple[float, Array]:
        """The size of round-off in the energy, J, and in its slopes, shape (3,); not proved."""
        value, slope = self.square.round_off[:2]
        first = float(self.bounds(self._longest, 1)[1].high[0])
        return first * float(value) + 1e-15 * self.largest, first * slope + 1e-15 * self.steepest
