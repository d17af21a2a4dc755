"""Where the values of a varied key come from: finite lists, and distributions over the reals."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.special import ndtri

from rbstab.mechanics.numbers import Array

MIN_VALUE = 2.0**-53
"""Coordinates of a design lie between this and one less this: no quantile is infinite."""


class Distribution(ABC):
    """Maps a coordinate of the unit interval to a value; `word` is its name in a plan."""

    word: ClassVar[str]

    @property
    @abstractmethod
    def arguments(self) -> list[float | str]:
        """What stands behind the word in a plan, every number a float."""

    @property
    @abstractmethod
    def ends(self) -> tuple[float, float]:
        """Two numbers between which every value lies."""

    @abstractmethod
    def quantile(self, u: Array) -> Array:
        """The values at coordinates in (0, 1): the inverse of the distribution function."""


class FiniteList(Distribution):
    """Numbered entries, as a grid needs; a coordinate picks each with the same probability."""

    @property
    @abstractmethod
    def length(self) -> int:
        """How many entries there are."""

    @abstractmethod
    def at(self, indices: Array) -> Array:
        """The entries at some indices from 0, without those between them."""

    @property
    def ends(self) -> tuple[float, float]:
        """Those of the list."""
        low, high = sorted(self.at(np.array([0, self.length - 1])).tolist())
        return low, high

    def quantile(self, u: Array) -> Array:
        """The values of this distribution."""
        # No product with a coordinate below 1 is rounded up to the length.
        return self.at((u * self.length).astype(np.int64))


@dataclass(frozen=True)
class Values(FiniteList):
    """Entries that are written out: numbers, or names of variants."""

    word = "values"
    entries: tuple[float, ...] | tuple[str, ...]

    @property
    def arguments(self) -> list[float | str]:
        """As in the plan."""
        return list(self.entries)

    @property
    def length(self) -> int:
        """The number of entries."""
        return len(self.entries)

    @cached_property
    def _array(self) -> Array:
        return np.array(self.entries, dtype=object if isinstance(self.entries[0], str) else float)

    @property
    def ends(self) -> tuple[float, float]:
        """Those of the list."""
        return float(min(self.entries)), float(max(self.entries))

    def at(self, indices: Array) -> Array:
        """The entries at some indices."""
        return self._array[indices]


@dataclass(frozen=True)
class _Spaced(FiniteList):
    """A list of which only both ends and the number of entries are kept."""

    first: float
    last: float
    count: int

    @property
    def arguments(self) -> list[float | str]:
        """As in the plan."""
        return [self.first, self.last, self.count]

    @property
    def length(self) -> int:
        """The number of entries."""
        return self.count

    def _line(self, first: float, last: float, indices: Array) -> Array:
        """As `numpy.linspace`, bit for bit."""
        steps = max(self.count - 1, 1)
        line = indices * ((last - first) / steps) + first
        return np.where((indices == steps), last, line)


@dataclass(frozen=True)
class Linspace(_Spaced):
    """`count` numbers with equal differences."""

    word = "linspace"

    def at(self, indices: Array) -> Array:
        """The entries at some indices."""
        return self._line(self.first, self.last, indices)


@dataclass(frozen=True)
class Logspace(_Spaced):
    """Powers of 10 whose exponents have equal differences."""

    word = "logspace"

    def at(self, indices: Array) -> Array:
        """The entries at some indices."""
        with np.errstate(over="ignore", under="ignore"):
            return np.power(10.0, self._line(self.first, self.last, indices))


@dataclass(frozen=True)
class Geomspace(_Spaced):
    """`count` numbers with equal ratios, both ends exact."""

    word = "geomspace"

    def at(self, indices: Array) -> Array:
        """The entries at some indices."""
        line = self._line(float(np.log10(self.first)), float(np.log10(self.last)), indices)
        low, high = sorted((self.first, self.last))
        inside = np.clip(np.power(10.0, line), low, high)
        at_last = (indices == self.count - 1) & (self.count > 1)
        return np.where(at_last, self.last, np.where(indices == 0, self.first, inside))


@dataclass(frozen=True)
class _Pair(Distribution):
    """A distribution of two parameters."""

    a: float
    b: float

    @property
    def arguments(self) -> list[float | str]:
        """As in the plan."""
        return [self.a, self.b]

    @property
    def ends(self) -> tuple[float, float]:
        """Both parameters."""
        return self.a, self.b


@dataclass(frozen=True)
class Uniform(_Pair):
    """Every number between a and b is equally probable."""

    word = "uniform"

    def quantile(self, u: Array) -> Array:
        """The values of this distribution."""
        return np.clip(self.a * (1 - u) + self.b * u, self.a, self.b)


@dataclass(frozen=True)
class Normal(_Pair):
    """The normal distribution of mean a and standard deviation b."""

    word = "normal"

    @property
    def ends(self) -> tuple[float, float]:
        """The values at the outermost coordinates, about eight standard deviations away."""
        low, high = self.quantile(np.array([MIN_VALUE, 1 - MIN_VALUE])).tolist()
        return low, high

    def quantile(self, u: Array) -> Array:
        """The values of this distribution."""
        with np.errstate(over="ignore"):
            return self.a + self.b * ndtri(u)


@dataclass(frozen=True)
class LogUniform(_Pair):
    """The logarithm is uniform between those of a and b."""

    word = "loguniform"

    def quantile(self, u: Array) -> Array:
        """The values of this distribution."""
        low, high = np.log(self.a), np.log(self.b)
        return np.clip(np.exp(low * (1 - u) + high * u), self.a, self.b)
