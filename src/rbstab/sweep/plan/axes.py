"""What a plan varies: columns, each a key of the config, and axes, each some columns together."""

from dataclasses import dataclass
from typing import Any

from rbstab.config.source import Path, key_of
from rbstab.sweep.plan.distributions import Distribution, FiniteList

VARIANT: Path = ("controller", "variant")


@dataclass(frozen=True)
class Column:
    """One key of the config and where its values come from.

    Args:
        path: The key, as a path.
        distribution: Of its values, or of the factor.
        scale: The values are factors, by which all that stands at the key in the base is
            multiplied.
        place: Where it stands in the plan, for messages.
    """

    path: Path
    distribution: Distribution
    scale: bool = False
    place: Path = ()

    @property
    def key(self) -> str:
        """The key as it is written in a plan."""
        return key_of(self.path)

    def applied(self, data: dict[str, Any], value: Any) -> None:
        """Puts a value (or what it makes of the one that is there) into the data of a config."""
        here: Any = data
        for part in self.path[:-1]:
            here = here[part]
        last = self.path[-1]
        here[last] = _times(value, here[last]) if self.scale else value


@dataclass(frozen=True)
class Axis:
    """Columns that move together: by the index of an entry, or by one coordinate of a design.

    Args:
        name: The key of its column, or the name of the `zip`.
        columns: One or more.
        each: Each entry is taken with every point of the design.
    """

    name: str
    columns: tuple[Column, ...]
    each: bool = False

    @property
    def length(self) -> int | None:
        """The number of its entries, which its lists share; None where it has no list."""
        lists = [c.distribution for c in self.columns if isinstance(c.distribution, FiniteList)]
        return lists[0].length if lists else None


def at(data: Any, path: Path) -> Any:
    """The value at a path of plain data.

    Raises:
        LookupError: The path leads nowhere.
    """
    here: Any = data
    for part in path:
        kind: Any = list if isinstance(part, int) else dict
        if not isinstance(here, kind):
            raise LookupError(key_of(path))
        here = here[part]
    return here


def _times(factor: float, value: Any) -> Any:
    if isinstance(value, list):
        return [_times(factor, entry) for entry in value]
    return factor * value
