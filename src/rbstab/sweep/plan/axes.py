"""The varied keys of a plan, and its axes: groups of keys that vary together."""

from dataclasses import dataclass
from typing import Any

from rbstab.config.numbers import changed_numbers, replaced
from rbstab.config.source import Path
from rbstab.config.units import NumberKey
from rbstab.sweep.plan.distributions import Distribution, FiniteList, MemberNumber

VARIANT: Path = ("controller", "variant")


@dataclass(frozen=True)
class VariedKey:
    """A key of the config that a plan varies, with the distribution of its values.

    Args:
        number_key: The key.
        distribution: The distribution of the values, or of the factors.
        scale: The values are factors. Each multiplies all numbers at the key in the base.
        place: The path of the key in the plan, for messages.
    """

    number_key: NumberKey
    distribution: Distribution
    scale: bool = False
    place: Path = ()

    @property
    def path(self) -> Path:
        """The path of its numbers in a config."""
        return self.number_key.path

    @property
    def key(self) -> str:
        """The key as it is written in a plan."""
        return self.number_key.text

    def factor(self, number: Any) -> Any:
        """Return what a value of the plan times is a number of a member, from that of the base."""
        return number if self.scale else self.number_key.factor

    def applied(self, data: dict[str, Any], value: Any) -> dict[str, Any]:
        """Return the data of a config with the value at the key replaced or scaled."""
        if isinstance(value, str):
            return dict(replaced(data, {self.path: value}))
        return dict(replaced(data, self.numbers(data, value)))

    def numbers(self, owner: Any, value: Any) -> dict[Path, Any]:
        """Return the new numbers at the key by path, of one member or of many in an array."""
        return changed_numbers(owner, self.number_key, value, scale=self.scale)


@dataclass(frozen=True)
class Axis:
    """Keys that vary together: they share a list index, or one coordinate of a design.

    Args:
        name: The varied key, or the name of the `zip`.
        varied_keys: The keys, at least one.
        each: Combine each entry with every point of the design.
    """

    name: str
    varied_keys: tuple[VariedKey, ...]
    each: bool = False

    @property
    def counts_members(self) -> bool:
        """Whether the axis only counts the members: it makes none, and draws nothing."""
        return isinstance(self.varied_keys[0].distribution, MemberNumber)

    @property
    def length(self) -> int | None:
        """The number of entries of each list of the axis; None if it has no list."""
        lists = [k.distribution for k in self.varied_keys if isinstance(k.distribution, FiniteList)]
        return lists[0].length if lists else None
