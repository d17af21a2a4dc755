"""The minimum to which the motion from a start is proved to converge, for many starts at once.

A start with less energy than the level of a region is in it if its Θ is in the component of
{U < level} about the minimum: theorem 5. Cells that prove this level show the component.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box
from rbstab.proof.enclosures.levels import Ranges
from rbstab.proof.model import Energy
from rbstab.proof.regions.cells import Cells, Component
from rbstab.proof.regions.landscape import Landscape
from rbstab.proof.search import Zeros


class RegionLevel(NamedTuple):
    """The region of a minimum: its place among the zeros, and its level, J."""

    state: int
    level: float


class StartRegions:
    """The regions of the minima of a range, for starts.

    Args:
        energy: The energy.
        zeros: The rest states of the range, lowest first, and boxes that may contain others.
        box: The range.
        regions: The regions, as they were proved.
    """

    def __init__(
        self, energy: Energy, zeros: Zeros, box: Box, regions: Sequence[RegionLevel]
    ) -> None:
        self.energy, self.zeros, self.box, self.regions = energy, zeros, box, regions
        self._components: dict[int, Component] = {}

    def find(self, energy: Array, low: Array, high: Array) -> Array:
        """Return the place of the region in which each start is proved to be, -1 if in none.

        Args:
            energy: Upper bounds of the total energy at each start, shape (m,), J.
            low: The lower corner of the box of Θ of each start, shape (m, 3), rad.
            high: The upper corner.
        """
        places = np.full(len(energy), -1)
        for k, region in enumerate(self.regions):
            for start in np.flatnonzero((places < 0) & (energy < region.level)):
                if self._component(k).contains(Box(low[start], high[start])):
                    places[start] = k
        return places

    @cached_property
    def _cells(self) -> Cells:
        return Cells.of(Landscape(self.energy, self.zeros, self.box, Ranges.of(self.energy)))

    def _component(self, k: int) -> Component:
        """Return the component of a region; it is made when it is first needed."""
        if k not in self._components:
            state, level = self.regions[k]
            self._components[k] = self._cells.up_to(state, level).component(state, level)
        return self._components[k]
