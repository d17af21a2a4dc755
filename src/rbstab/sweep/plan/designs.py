"""Points of the unit cube, numbered: any part of a design can be had without the rest.

No coordinate is 0 or 1. Every coordinate has a stream of random bits of its own (Philox, which is
counted and not stepped), so that a point depends on the seed and its number alone. The bits are
turned into numbers here, for those of a generator's methods may change between versions of numpy.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.distributions import MIN_VALUE

SOBOL_BITS = 32
"""Those of a Sobol coordinate; 2³² points are more than a plan may have."""


@dataclass(frozen=True, eq=False)
class Design(ABC):
    """A sequence of points in a unit cube.

    Args:
        dimensions: Coordinates of a point.
        points: How many points there are.
        seed: From 0.
    """

    word: ClassVar[str]
    dimensions: int
    points: int
    seed: int

    @abstractmethod
    def part(self, start: int, stop: int) -> Array:
        """The points from number `start` up to `stop`, shape (dimensions, stop - start)."""


class RandomDesign(Design):
    """Independent points, uniform in the cube."""

    word = "random"

    def part(self, start: int, stop: int) -> Array:
        """The points from number `start` up to `stop`."""
        streams = [_uniforms(self.seed, j, start, stop) for j in range(self.dimensions)]
        return np.array(streams).reshape(self.dimensions, stop - start)


class SobolDesign(Design):
    """Scrambled Sobol points: even at every beginning, most so where it is a power of 2 long."""

    word = "sobol"

    def part(self, start: int, stop: int) -> Array:
        """The points from number `start` up to `stop`."""
        # Imported late: SciPy's statistics take longer to load than most plans to expand.
        from scipy.stats import qmc

        rng = np.random.default_rng(self.seed)
        engine = qmc.Sobol(self.dimensions, scramble=True, bits=SOBOL_BITS, seed=rng)
        parts = []
        if start > 0:
            engine.fast_forward(start)
        elif stop > 0:
            # The first one alone: SciPy warns of a beginning whose length is no power of 2.
            parts.append(engine.random(1))
        parts.append(engine.random(stop - start - sum(map(len, parts))))
        # To the middle of the cell of the last bit, away from 0.
        return np.ascontiguousarray(np.concatenate(parts).T) + 0.5**SOBOL_BITS / 2


class LatinHypercubeDesign(Design):
    """Each coordinate has one point in each of `points` equal intervals."""

    word = "latin-hypercube"

    @cached_property
    def _intervals(self) -> list[Array]:
        """The interval of every point, for each coordinate: the one thing that is kept whole."""
        return [
            np.argsort(_stream(self.seed, 2 * j, 0, self.points), kind="stable").astype(np.uint32)
            for j in range(self.dimensions)
        ]

    def part(self, start: int, stop: int) -> Array:
        """The points from number `start` up to `stop`."""
        u = np.empty((self.dimensions, stop - start))
        for j, intervals in enumerate(self._intervals):
            u[j] = (
                intervals[start:stop] + _uniforms(self.seed, 2 * j + 1, start, stop)
            ) / self.points
        return np.clip(u, MIN_VALUE, 1 - MIN_VALUE)


DESIGNS: dict[str, type[Design]] = {
    design.word: design for design in (RandomDesign, SobolDesign, LatinHypercubeDesign)
}


def _stream(seed: int, number: int, start: int, stop: int) -> Array:
    """Entries of a stream of 64 random bits each; a Philox counter yields four of them."""
    key = np.random.SeedSequence(seed).generate_state(2, np.uint64)
    bits = np.random.Philox(key=key, counter=[0, 0, 0, number])
    bits.advance(start // 4)
    return bits.random_raw(stop - start + start % 4)[start % 4 :]


def _uniforms(seed: int, number: int, start: int, stop: int) -> Array:
    """Entries of a stream as odd multiples of 2⁻⁵³ in (0, 1)."""
    return ((_stream(seed, number, start, stop) >> np.uint64(12)) + 0.5) * 2.0**-52
