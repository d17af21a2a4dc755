"""The varied keys of a plan, and its axes: groups of keys that vary together.

Varied numbers are those of a base config, with the values of many members.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from rbstab.config.numbers import changed_numbers
from rbstab.config.schema import Config
from rbstab.config.source import Path
from rbstab.config.units import NumberKey, number_key
from rbstab.sweep.plan.distributions import Distribution, FiniteList, Member
from rbstab.sweep.plan.plan_file import Column, Group, Varied

VARIANT: Path = ("controller", "variant")

VARIED_SECTIONS = ("body", "gravity", "controller", "elements", "initial")
"""The sections whose numbers may vary. All members share the integration."""


@dataclass(frozen=True)
class VariedKey:
    """A key of the config that a plan varies, with the distribution of its values.

    Args:
        key: The key as it is written in a plan.
        column: What stands at the key.
        place: The path of the key in the plan, for messages.
    """

    key: str
    column: Column
    place: Path = ()

    @cached_property
    def number_key(self) -> NumberKey:
        """The key, read; its path is empty if it is not a key."""
        return number_key(self.key) or NumberKey(())

    @property
    def path(self) -> Path:
        """The path of its numbers in a config."""
        return self.number_key.path

    @property
    def scale(self) -> bool:
        """Whether the values are factors. Each multiplies all numbers at the key in the base."""
        return self.column.content[0] == "scale"

    @property
    def distribution(self) -> Distribution:
        """The distribution of the values, or of the factors."""
        content = self.column.content[1]
        distribution: Distribution = content.content[1] if self.scale else content
        return distribution

    def factor(self, number: Any) -> Any:
        """Return what a value of the plan times is a number of a member, from that of the base."""
        return number if self.scale else self.number_key.factor

    def numbers(self, owner: Any, value: Any) -> dict[Path, Any]:
        """Return the new numbers at the key by path, of one member or of many in an array."""
        return changed_numbers(owner, self.number_key, value, scale=self.scale)


@dataclass(frozen=True)
class Axis:
    """Keys that vary together: they share a list index, or one coordinate of a design.

    Args:
        name: The varied key, or the name of the `zip`.
        varied: What stands at the name in the plan.
    """

    name: str
    varied: Varied

    @property
    def each(self) -> bool:
        """Whether each entry is combined with every point of the design."""
        return self.varied.content[0] == "each"

    @cached_property
    def varied_keys(self) -> tuple[VariedKey, ...]:
        """The keys, at least one."""
        place: Path = ("vary", self.name)
        group: Group = self.varied.each if self.each else self.varied
        if group.content[0] != "zip":
            return (VariedKey(self.name, group, place),)
        inside = (*place, "each", "zip") if self.each else (*place, "zip")
        return tuple(VariedKey(key, column, (*inside, key)) for key, column in group.zip.items())

    @property
    def counts_members(self) -> bool:
        """Whether the axis only counts the members: it makes none, and draws nothing."""
        return isinstance(self.varied_keys[0].distribution, Member)

    @cached_property
    def length(self) -> int | None:
        """The number of entries of each list of the axis; None if it has no list."""
        lists = [k.distribution for k in self.varied_keys if isinstance(k.distribution, FiniteList)]
        return lists[0].length if lists else None


def varied_numbers(
    base: Config | Mapping[str, Any],
    varied_keys: Sequence[VariedKey],
    values: Mapping[str, Any],
) -> dict[Path, Any]:
    """Return the values of all varied numbers by their paths, in the order of the keys.

    Args:
        base: The base, or its plain data.
        varied_keys: The keys that the base has.
        values: The values (or factors) of each key: a number, or an array for many members.
    """
    return {
        path: numbers
        for varied in varied_keys
        for path, numbers in varied.numbers(base, values[varied.key]).items()
    }


def varied_paths(base: Config, varied_keys: Sequence[VariedKey]) -> list[Path]:
    """Return the paths of all varied numbers, in the order of the keys."""
    return list(varied_numbers(base, varied_keys, {varied.key: 1.0 for varied in varied_keys}))
