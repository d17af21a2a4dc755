"""The value of a number of a config at which an answer changes, and its place in a sentence."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from rbstab.config.numbers import entries_under, unit_at
from rbstab.config.schema import Config
from rbstab.config.source import Path
from rbstab.mechanics.numbers import Array

DIGITS = 4
"""Significant digits of the values in a sentence."""


class NamedNumber(NamedTuple):
    """A number of a config as people name it.

    Attributes:
        name: Its key without the section, such as `K_r[0]`.
        unit: Its unit; "" for none.
        value: Its value.
    """

    name: str
    unit: str
    value: float

    @property
    def text(self) -> str:
        """The name with the unit in brackets, as the head of a column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def named_number(config: Config, path: Path) -> NamedNumber:
    """Return the first number at a path of a config that is not zero, or the first of all.

    Raises:
        LookupError: The config has no such path.
    """
    numbers = entries_under(config, path)
    number = next((entry for entry in numbers if entry.value), numbers[0])
    return NamedNumber(short_key(number.key), unit_at(config, number.key), number.value)


def short_key(key: str) -> str:
    """Return a key without its section, such as `K_r[0]`, or `initial orientation[1]`."""
    section, _, rest = key.partition(".")
    return f"initial {rest}" if section == "initial" else rest or section


class Threshold(NamedTuple):
    """Where the members that are good end along a number, and those that are not.

    Attributes:
        good: From this value on all members are good.
        bad: Up to this value members are bad; None if none is.
        last_open: The value next to `good` at which not all members are good.
        upward: Whether larger values are good, or else smaller ones.
    """

    good: float
    bad: float | None
    last_open: float
    upward: bool

    def beyond(self, value: float, values: Array, *, good: bool) -> Array:
        """Return which values lie on the good side, or the bad side, of a value, and at it.

        Args:
            value: The value.
            values: The values of members, shape (m,).
            good: Whether the good side is meant, or else the bad one.
        """
        return values >= value if good is self.upward else values <= value

    def sign(self, *, good: bool) -> str:
        """Return the sign before a value from which on members are good, or bad."""
        return "≥" if good is self.upward else "≤"


def threshold_of(values: Array, good: Array, bad: Array) -> Threshold | None:
    """Return the threshold if the values separate good members from bad ones; None if not.

    Members that are neither are open. They may lie between both, and among the bad ones. If no
    member is bad, the values must separate the good members from the open ones.

    Args:
        values: The value of each member, shape (m,).
        good: Whether each member is good, shape (m,).
        bad: Whether each is bad, shape (m,).
    """
    others = bad if bad.any() else ~good
    if not good.any() or not others.any():
        return None
    for sign in (1.0, -1.0):
        along = sign * values
        last_open = along[~good].max()
        from_here = good & (along > last_open)
        if along[others].max() >= along[good].min() or not from_here.any():
            continue
        last_bad = float(sign * along[bad].max()) if bad.any() else None
        start = float(sign * along[from_here].min())
        return Threshold(start, last_bad, float(sign * last_open), sign > 0)
    return None


def alike(values: Iterable[float]) -> dict[float, str]:
    """Return values as texts with the same number of decimals, enough to tell them apart."""
    every = list(values)
    for digits in range(DIGITS, 17):
        texts = [f"{value:.{digits}g}" for value in every]
        if len(set(texts)) == len(set(every)):
            break
    if any("e" in text for text in texts):
        return dict(zip(every, texts, strict=True))
    decimals = max((len(text.partition(".")[2]) for text in texts), default=0)
    return {value: f"{float(text):.{decimals}f}" for value, text in zip(every, texts, strict=True)}


def by_chance(good: int, others: int, numbers: int) -> float:
    """Return at most how likely it is that one of several sampled numbers separates members.

    If the numbers have no effect, each order of the good and the other members along one of them
    is equally likely; two orders separate them.

    Args:
        good: How many members are good.
        others: How many members are not.
        numbers: How many numbers are sampled.
    """
    logarithm = math.lgamma(good + others + 1) - math.lgamma(good + 1) - math.lgamma(others + 1)
    return min(1.0, 2.0 * numbers * math.exp(-logarithm))


def distinct(values: Array) -> list[float]:
    """Return the distinct values, ascending."""
    unique: list[float] = np.unique(values).tolist()
    return unique
