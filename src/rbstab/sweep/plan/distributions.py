"""Distributions of the values of a varied key: finite lists, and continuous distributions.

Each is a pydantic model of its arguments in the file of a plan, `[0, 1, 11]`, and has their values.
"""

import math
from collections.abc import Callable
from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    RootModel,
    WrapValidator,
    model_validator,
)

from rbstab.config.errors import describe, entries, hint
from rbstab.config.quantities import Count, Real, value_error, whole
from rbstab.config.schema import VARIANTS
from rbstab.mechanics.numbers import Array

NotNegativeWhole = Annotated[int, Field(ge=0), BeforeValidator(whole)]

MIN_VALUE = 2.0**-53
"""Coordinates of a design lie between this and 1 minus this, so that quantiles are finite."""


def listed(form: str, *lengths: int, empty: bool = False) -> tuple[Any, ...]:
    """Return what makes a type take a list of one of these lengths, or of any length but 0."""

    def check(value: Any) -> Any:
        if not isinstance(value, list | tuple):
            raise value_error(f"is {describe(value)}", f"expected {form}")
        if (lengths and len(value) not in lengths) or not (value or empty):
            raise value_error(f"has {entries(value)}", f"expected {form}")
        return value

    return Field(strict=False, description=form), BeforeValidator(check)


def _name_or_number(value: Any, number: Any) -> Any:
    if not isinstance(value, str):
        return number(value)
    if value not in VARIANTS:
        expected = f"expected a number, or one of {', '.join(VARIANTS)}{hint(value, VARIANTS)}"
        raise value_error(f"is {describe(value)}", expected)
    return value


Entry = Annotated[
    Real,
    WrapValidator(_name_or_number, json_schema_input_type=float | Literal[tuple(VARIANTS)]),
    PlainSerializer(lambda entry: entry),
]
"""A number, or the name of a variant."""

_Pair = tuple[Real, Real]
_Spaced = Annotated[tuple[Real, Real, Count], *listed("[first, last, count]", 3)]


class Distribution(RootModel[Any]):
    """A map from the unit interval to values; the root has its arguments.

    Attributes:
        requirement: A condition on the first two arguments, and what it expects.
    """

    model_config = ConfigDict(frozen=True, strict=True, defer_build=True)
    requirement: ClassVar[tuple[Callable[[float, float], bool], str] | None] = None

    @property
    def keyword(self) -> str:
        """Its name in a plan."""
        return type(self).__name__.lower()

    @property
    def bounds(self) -> tuple[float, float]:
        """A lower and an upper bound of all values: here, the two arguments."""
        low, high = self.root
        return low, high

    def quantile(self, u: Array) -> Array:
        """Return the values at coordinates in (0, 1), by the inverse distribution function."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _check(self) -> "Distribution":
        if self.requirement is not None:
            allows, expected = self.requirement
            a, b = self.root[:2]
            if not allows(a, b):
                raise value_error(f"is [{a:.12g}, {b:.12g}]", f"expected {expected}")
            if not np.isfinite(self.bounds).all():
                raise value_error("exceeds the range of numbers", "expected finite values")
        return self


class FiniteList(Distribution):
    """A list of entries, as a grid needs. A design draws all entries with equal probability."""

    @property
    def length(self) -> int:
        """The number of entries."""
        return int(self.root[2])

    def at(self, indices: Array) -> Array:
        """Return the entries at some indices, counted from 0."""
        raise NotImplementedError

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest entry."""
        low, high = sorted(self.at(np.array([0, self.length - 1])).tolist())
        return low, high

    def quantile(self, u: Array) -> Array:
        """Return the values at coordinates in (0, 1)."""
        # All coordinates are below 1, so the product is never rounded up to the length.
        return self.at((u * self.length).astype(np.int64))

    def _linspace(self, first: float, last: float, indices: Array) -> Array:
        """Return the entries at some indices, equal to those of `numpy.linspace` bit for bit."""
        steps = max(self.length - 1, 1)
        line = indices * ((last - first) / steps) + first
        return np.where((indices == steps), last, line)


class Values(FiniteList):
    """A list written out in the plan: numbers, or names of variants, which its key decides."""

    root: Annotated[tuple[Entry, ...], Field(min_length=1), *listed("a list of values")]

    @property
    def length(self) -> int:
        """The number of entries."""
        return len(self.root)

    @cached_property
    def _array(self) -> Array:
        return np.array(self.root, dtype=object if isinstance(self.root[0], str) else float)

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest entry."""
        return float(min(self.root)), float(max(self.root))

    def at(self, indices: Array) -> Array:
        """Return the entries at some indices."""
        return self._array[indices]


class Linspace(FiniteList):
    """[first, last, count]: equally spaced numbers."""

    root: _Spaced
    requirement = lambda a, b: math.isfinite(b - a), "numbers whose difference is finite"

    def at(self, indices: Array) -> Array:
        """Return the entries at some indices."""
        return self._linspace(*self.root[:2], indices)


class Logspace(FiniteList):
    """[first, last, count] of the exponents: powers of 10 with equally spaced exponents."""

    root: _Spaced
    requirement = lambda a, b: max(abs(a), abs(b)) <= 308, "exponents of 10 from -308 to 308"

    def at(self, indices: Array) -> Array:
        """Return the entries at some indices."""
        with np.errstate(over="ignore", under="ignore"):
            return np.power(10.0, self._linspace(*self.root[:2], indices))


class Geomspace(FiniteList):
    """[first, last, count]: numbers with equal ratios; the first and the last are exact."""

    root: _Spaced
    requirement = lambda a, b: min(a, b) > 0, "numbers greater than 0"

    def at(self, indices: Array) -> Array:
        """Return the entries at some indices."""
        first, last, count = self.root
        line = self._linspace(float(np.log10(first)), float(np.log10(last)), indices)
        inside = np.clip(np.power(10.0, line), min(first, last), max(first, last))
        at_last = (indices == count - 1) & (count > 1)
        return np.where(at_last, last, np.where(indices == 0, first, inside))


class Member(Distribution):
    """[first]: no distribution, but whole numbers that count the members, as seeds of noises."""

    root: Annotated[tuple[NotNegativeWhole], *listed("[first]", 1)]

    @property
    def bounds(self) -> tuple[float, float]:
        """The first number: all others are valid seeds as well if it is one."""
        return self.root[0], self.root[0]

    def at(self, numbers: Array) -> Array:
        """Return the values of members with these numbers, counted from 0."""
        return self.root[0] + numbers.astype(float)


class Uniform(Distribution):
    """[a, b]: the uniform distribution between a and b."""

    root: Annotated[_Pair, *listed("[a, b]", 2)]
    requirement = lambda a, b: a < b, "a < b"

    def quantile(self, u: Array) -> Array:
        """Return the values at coordinates in (0, 1)."""
        a, b = self.root
        return np.clip(a * (1 - u) + b * u, a, b)


class Normal(Distribution):
    """[mean, sd]: the normal distribution with this mean and standard deviation."""

    root: Annotated[_Pair, *listed("[mean, sd]", 2)]
    requirement = lambda _, sd: sd > 0, "a standard deviation above 0"

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
            return self.root[0] + self.root[1] * ndtri(u)


class LogUniform(Distribution):
    """[a, b], 0 < a < b: the log-uniform distribution between a and b."""

    root: Annotated[_Pair, *listed("[a, b]", 2)]
    requirement = lambda a, b: 0 < a < b, "0 < a < b"

    def quantile(self, u: Array) -> Array:
        """Return the values at coordinates in (0, 1)."""
        a, b = self.root
        low, high = np.log(a), np.log(b)
        return np.clip(np.exp(low * (1 - u) + high * u), a, b)
