"""The single numbers of a config, and the same config with some of them moved."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from rbstab.config.schema import Config
from rbstab.config.section import Section
from rbstab.config.source import Path, key_of
from rbstab.mechanics.numbers import Number

GAINS = ("K_t", "L_t", "K_r", "L_r", "K_c", "L_c", "K_d", "L_d")
"""The positive definite gains of all controllers."""


class Entry(NamedTuple):
    """An independent number of a config.

    key is how a message or `--set` names it; places are where it stands, two for an entry beside
    the diagonal of a symmetric matrix, of which key is the first.
    """

    key: str
    value: float
    places: tuple[Path, ...]


def entries_of(config: Config) -> tuple[Entry, ...]:
    """The numbers of the gains, the body and the initial state, in this order.

    A diagonal has three, a symmetric matrix six: an entry beside the diagonal and its mirror image
    are one number.
    """
    gains = [("controller", name) for name in GAINS if hasattr(config.controller, name)]
    body = [("body", name) for name in type(config.body).model_fields]
    initial = [("initial", name) for name in type(config.initial).model_fields]
    return tuple(
        entry for path in (*gains, *body, *initial) for entry in entries_under(config, path)
    )


def entries_under(config: Config, path: Path) -> tuple[Entry, ...]:
    """The independent numbers at a path and below it."""
    value = value_at(config, path)
    if not isinstance(value, tuple):
        return (Entry(key_of(path), value, (path,)),)
    if not isinstance(value[0], tuple):
        return tuple(Entry(key_of((*path, i)), x, ((*path, i),)) for i, x in enumerate(value))
    found = []
    for i in range(3):
        for j in range(i, 3):
            here, mirrored = (*path, i, j), (*path, j, i)
            places = (here,) if i == j else (here, mirrored)
            found.append(Entry(key_of(here), value[i][j], places))
    return tuple(found)


def value_at(config: Config, path: Path) -> Any:
    """What stands at a path.

    Raises:
        LookupError: Nothing does.
    """
    here: Any = config
    for part in path:
        if isinstance(part, int):
            if not (isinstance(here, tuple) and part < len(here)):
                raise LookupError(key_of(path))
            here = here[part]
        elif isinstance(here, Section) and part in type(here).model_fields:
            here = getattr(here, part)
        else:
            raise LookupError(key_of(path))
    return here


def moved(config: Config, shift: Mapping[Path, Number]) -> Config:
    """A config with something added to some of its numbers, which is not validated.

    The shift may be complex: then so is every quantity that is computed from the config, and its
    imaginary part is a derivative (see `derivatives.jacobian`).

    Args:
        config: The config.
        shift: What is added, by the path of the number.
    """
    return replaced(config, {path: value_at(config, path) + by for path, by in shift.items()})


def replaced(config: Config, numbers: Mapping[Path, Number]) -> Config:
    """A config with other numbers at some paths, of any kind, which is not validated.

    Args:
        config: The config.
        numbers: The new ones, by path.
    """
    changed: Config = _replaced(config, (), numbers)
    return changed


def _replaced(value: Any, path: Path, numbers: Mapping[Path, Number]) -> Any:
    if path in numbers:
        return numbers[path]
    inside = {key[len(path)] for key in numbers if key[: len(path)] == path}
    if not inside:
        return value
    if isinstance(value, tuple):
        return tuple(_replaced(entry, (*path, i), numbers) for i, entry in enumerate(value))
    changes = {
        part: _replaced(getattr(value, str(part)), (*path, part), numbers) for part in inside
    }
    return value.model_copy(update=changes)
