"""The varied keys of a plan, and its axes: groups of keys that vary together."""

from dataclasses import dataclass
from typing import Any

from rbstab.config.source import Path, key_of
from rbstab.sweep.plan.distributions import Distribution, FiniteList, MemberNumber

VARIANT: Path = ("controller", "variant")


@dataclass(frozen=True)
class VariedKey:
    """A key of the config that a plan varies, with the distribution of its values.

    Args:
        path: The key, as a path.
        distribution: The distribution of the values, or of the factors.
        scale: The values are factors. Each multiplies all numbers at the key in the base.
        place: The path of the key in the plan, for messages.
    """

    path: Path
    distribution: Distribution
    scale: bool = False
    place: Path = ()

    @property
    def key(self) -> str:
        """The key as it is written in a plan."""
        return key_of(self.path)

    def apply(self, data: dict[str, Any], value: Any) -> None:
        """Replace or scale the value at the key in the data of a config."""
        here: Any = data
        for part in self.path[:-1]:
            here = here[part]
        last = self.path[-1]
        here[last] = _scaled(value, here[last]) if self.scale else value


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


def value_at(data: Any, path: Path) -> Any:
    """Return the value at a path of plain data.

    Raises:
        LookupError: The data has no such path.
    """
    here: Any = data
    for part in path:
        kind: Any = list if isinstance(part, int) else dict
        if not isinstance(here, kind):
            raise LookupError(key_of(path))
        here = here[part]
    return here


def _scaled(factor: float, value: Any) -> Any:
    if isinstance(value, list):
        return [_scaled(factor, entry) for entry in value]
    return factor * value
