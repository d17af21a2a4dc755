"""The numbers of a base config that a plan varies, with the values of many members."""

from collections.abc import Mapping, Sequence
from typing import Any

from rbstab.config.schema import Config
from rbstab.config.source import Path
from rbstab.sweep.plan.axes import VariedKey


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
