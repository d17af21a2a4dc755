"""The numbers of a base config that a plan varies, with the values of many members."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rbstab.config.entries import value_at
from rbstab.config.schema import Config
from rbstab.config.source import Path
from rbstab.sweep.plan.axes import VariedKey


def varied_numbers(
    base: Config, varied_keys: Sequence[VariedKey], values: Mapping[str, Any]
) -> dict[Path, Any]:
    """Return the values of all varied numbers by their paths, in the order of the keys.

    Args:
        base: The base.
        varied_keys: The keys that the base has.
        values: The values (or factors) of each key: a number, or an array for many members.
    """
    return {
        path: values[varied.key] * number if varied.scale else values[varied.key]
        for varied in varied_keys
        for path, number in _numbers_below(value_at(base, varied.path), varied.path)
    }


def varied_paths(base: Config, varied_keys: Sequence[VariedKey]) -> list[Path]:
    """Return the paths of all varied numbers, in the order of the keys."""
    return list(varied_numbers(base, varied_keys, {varied.key: 1.0 for varied in varied_keys}))


def _numbers_below(value: Any, path: Path) -> Iterator[tuple[Path, float]]:
    """Yield the path and value of each number at a path and below it."""
    if isinstance(value, tuple):
        for index, entry in enumerate(value):
            yield from _numbers_below(entry, (*path, index))
    else:
        yield path, value
