"""Distributions of the values of a varied key: finite lists, and continuous distributions."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from rbstab.mechanics.numbers import Array

MIN_VALUE = 2.0**-53
"""Coordinates of a design lie between this and 1 minus this, so that quantiles are finite."""


class Distribution(ABC):
    """A map from the unit interval to values; `keyword` is its name in a plan."""

    keyword: ClassVar[str]

    @property
    @abstractmethod
    def arguments(self) -> list[float | str]:
        """The arguments after the keyword in a plan; all numbers are floats."""

    @property
    @abstractmethod
    def bounds(self) -> tuple[float, float]:
        """A lower and an upper bound of all values."""

    @abstractmethod
    def quantile(self, u: Array) -> Array:
        """Return the values at coordinates in (0, 1), by the inverse distribution function."""


class FiniteList(Distribution):
    """A list of entries, as a grid needs. A design draws all entries with equal probability."""

    @property
    @abstractmethod
    def length(self) -> int:
        """The number of entries."""

    @abstractmethod
    def at(self, indices: Array) -> Array:
        """Return the entries at some indices, counted from 0."""

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest entry."""
        low, high = sorted(self.at(np.array([0, self.length - 1])).tolist())
        return low, high

    def quantile(self, u: Array) -> Array:
        """Return the values at coordinates in (0, 1)."""
        # All coordinates are below 1, so the product is never rounded up to the length.
        return self.at((u * self.length).astype(np.int64))


@dataclass(frozen=True)
class Values(FiniteList):
    """A list written out in the plan: numbers, or names of variants."""

    keyword = "values"
    entries: tuple[float, ...] | tuple[str, ...]

    @property
    def arguments(self) -> list[float | str]:
        """The arguments as in the plan."""
        return list(self.entries)

    @property
    def length(self) -> int:
        """The number of entries."""
        return len(self.entries)

    @cached_property
    def _array(self) -> Array:
        return np.array(self.entries, dtype=object if isinstance(self.entries[0], str) else float)

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest entry."""
        return float(min(self.entries)), float(max(self.entries))

    def at(self, indices: Array) -> Array:
        """Return the entries at some indices."""
        return self._array[indices]


@dataclass(frozen=True)
class _SpacedList(FiniteList):
    """A list stored as its first entry, its last entry and its length."""

    first: float
    last: float
    count: int

    @property
    def arguments(self) -> list[float | str]:
        """The arguments as in the plan."""
        return [self.first, self.last, self.count]

    @property
    def length(self) -> int:
        """The number of entries."""
        return self.count

    def _linspace(self, first: float, last: float, indices: Array) -> Array:
        """Return the entries at some indices, equal to those of `numpy.linspace` bit for bit."""
        steps = max(self.count - 1, 1)
        line = indices * ((last - first) / steps) + first
        return np.where((indices == steps), last, line)


@dataclass(frozen=True)
class Linspace(_SpacedList):
    """`count` equally spaced numbers."""

    keyword = "linspace"

    def at(self, indices: Array) -> Array:
        """Return the entries at some indices."""
        return self._linspace(self.first, self.last, indices)


@dataclass(frozen=True)
class Logspace(_SpacedList):
    """Powers of 10 with equally spaced exponents."""

    keyword = "logspace"

    def at(self, indices: Array) -> Array:
        """Return the entries at some indices."""
        with np.errstate(over="ignore", under="ignore"):
            return np.power(10.0, self._linspace(self.first, self.last, indices))


@dataclass(frozen=True)
class Geomspace(_SpacedList):
    """`count` numbers with equal ratios; the first and the last are exact."""

    keyword = "geomspace"

    def at(self, indices: Array) -> Array:
        """Return the entries at some indices."""
        line = self._linspace(float(np.log10(self.first)), float(np.log10(self.last)), indices)
        low, high = sorted((self.first, self.last))
        inside = np.clip(np.power(10.0, line), low, high)
        at_last = (indices == self.count - 1) & (self.count > 1)
        return np.where(at_last, self.last, np.where(indices == 0, self.first, inside))


@dataclass(frozen=True)
class MemberNumber(Distribution):
    """No distribution: whole numbers that count the members, as seeds of their noises."""

    keyword = "member"
    first: int

    @property
    def arguments(self) -> list[float | str]:
        """The first number."""
        return [self.first]

    @property
    def bounds(self) -> tuple[float, float]:
        """The first number: all others are valid seeds as well if it is one."""
        return self.first, self.first

    def at(self, numbers: Array) -> Array:
        """Return the values of members with these numbers, counted from 0."""
        return self.first + numbers.astype(float)

    def quantile(self, u: Array) -> Array:
        """Never called: a plan gives no coordinate to this key."""
        raise TypeError("the number of a member is not drawn")


@dataclass(frozen=True)
class _TwoParameters(Distribution):
    """A distribution with two parameters."""

    a: float
    b: float

    @property
    def arguments(self) -> list[float | str]:
        """The arguments as in the plan."""
        return [self.a, self.b]

    @property
    def bounds(self) -> tuple[float, float]:
        """The two parameters, which bound the values."""
        return self.a, self.b


@dataclass(frozen=True)
class Uniform(_TwoParameters):
    """The uniform distribution between a and b."""

    keyword = "uniform"

    def quantile(self, u: Array) -> Array:
        """Return the values at coordinates in (0, 1)."""
        return np.clip(self.a * (1 - u) + self.b * u, self.a, self.b)


@dataclass(frozen=True)
class Normal(_TwoParameters):
    """The normal distribution with mean a and standard deviation b."""

    keyword = "normal"

    @property
    def bounds(self) -> tuple[float, float]:
        """The values at the outermost coordinates, about eight standard deviations away."""
        low, high = self.quantile(np.array([MIN_VALUE, 1 - MIN_VALUE])).tolist()
        return low, high

    def quantile(self, u: Array) -> Array:
        """Return the values at coordinates in (0, 1)."""
        # Imported late: it takes as long as a thousand members.
        from scipy.special import ndtri

        with np.errstate(over="ignore"):
            return self.a + self.b * ndtri(u)


@dataclass(frozen=True)
class LogUniform(_TwoParameters):
    """The log-uniform distribution between a and b."""

    keyword = "loguniform"

    def quantile(self, u: Array) -> Array:
        """Return the values at coordinates in (0, 1)."""
        low, high = np.log(self.a), np.log(self.b)
        return np.clip(np.exp(low * (1 - u) + high * u), self.a, self.b)
