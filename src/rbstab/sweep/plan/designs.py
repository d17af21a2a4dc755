"""Designs: numbered points in the unit cube. Any range can be computed without other points.

No coordinate is 0 or 1. Random points and latin hypercubes have one stream of random bits for each
coordinate. The generator, Philox, is based on a counter, so a point depends only on the seed and
its number. This module converts the bits to floats: numpy's conversion may change between versions.
Sobol points come from SciPy.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.distributions import MIN_VALUE

SOBOL_BITS = 32
"""Bits of a Sobol coordinate. 2³² points are more than a plan may have."""


@dataclass(frozen=True, eq=False)
class Design(ABC):
    """A sequence of points in a unit cube; `keyword` is its name in a plan.

    Args:
        dimensions: The number of coordinates of a point.
        points: The number of points.
        seed: An integer, at least 0.
    """

    keyword: ClassVar[str]
    independent: ClassVar[bool] = False
    """Whether points are independent draws, as binomial confidence intervals assume."""
    max_points: ClassVar[int | None] = None
    """The largest number of points, if the design has a limit of its own."""

    dimensions: int
    points: int
    seed: int

    @abstractmethod
    def draw(self, start: int, stop: int) -> Array:
        """Return the points from number `start` up to `stop`, shape (dimensions, stop - start).

        Args:
            start: The number of the first point.
            stop: One after the last point, as in `range`.
        """


class RandomDesign(Design):
    """Independent points, uniform in the cube."""

    keyword = "random"
    independent = True

    def draw(self, start: int, stop: int) -> Array:
        """Return the points from number `start` up to `stop`."""
        streams = [_uniforms(self.seed, j, start, stop) for j in range(self.dimensions)]
        return np.array(streams).reshape(self.dimensions, stop - start)


class SobolDesign(Design):
    """Scrambled Sobol points: evenly spread, and most evenly if their number is a power of 2."""

    keyword = "sobol"

    def draw(self, start: int, stop: int) -> Array:
        """Return the points from number `start` up to `stop`."""
        # Imported late: loading scipy.stats takes longer than expanding most plans.
        from scipy.stats import qmc

        rng = np.random.default_rng(self.seed)
        engine = qmc.Sobol(self.dimensions, scramble=True, bits=SOBOL_BITS, seed=rng)
        pieces = []
        if start > 0:
            engine.fast_forward(start)
        elif stop > 0:
            # Draw one point first: SciPy warns if the first call does not draw a power of 2.
            pieces.append(engine.random(1))
        pieces.append(engine.random(stop - start - sum(map(len, pieces))))
        # Shift each point to the middle of its cell of width 2⁻³², away from 0.
        return np.ascontiguousarray(np.concatenate(pieces).T) + 0.5**SOBOL_BITS / 2


class LatinHypercubeDesign(Design):
    """Latin hypercube: each coordinate has one point in each of `points` equal intervals."""

    keyword = "latin-hypercube"
    # The intervals of all points are kept in memory.
    max_points = 2_000_000

    @cached_property
    def _intervals(self) -> list[Array]:
        """For each coordinate, the index of the interval of each point; computed once."""
        return [
            np.argsort(_stream(self.seed, 2 * j, 0, self.points), kind="stable").astype(np.uint32)
            for j in range(self.dimensions)
        ]

    def draw(self, start: int, stop: int) -> Array:
        """Return the points from number `start` up to `stop`."""
        u = np.empty((self.dimensions, stop - start))
        for j, intervals in enumerate(self._intervals):
            u[j] = (
                intervals[start:stop] + _uniforms(self.seed, 2 * j + 1, start, stop)
            ) / self.points
        return np.clip(u, MIN_VALUE, 1 - MIN_VALUE)


DESIGNS: dict[str, type[Design]] = {
    design.keyword: design for design in (RandomDesign, SobolDesign, LatinHypercubeDesign)
}


def _stream(seed: int, number: int, start: int, stop: int) -> Array:
    """Return entries of a stream, 64 random bits each. One Philox counter gives four entries."""
    key = np.random.SeedSequence(seed).generate_state(2, np.uint64)
    bits = np.random.Philox(key=key, counter=[0, 0, 0, number])
    bits.advance(start // 4)
    return bits.random_raw(stop - start + start % 4)[start % 4 :]


def _uniforms(seed: int, number: int, start: int, stop: int) -> Array:
    """Return entries of a stream as odd multiples of 2⁻⁵³ in (0, 1)."""
    return ((_stream(seed, number, start, stop) >> np.uint64(12)) + 0.5) * 2.0**-52
