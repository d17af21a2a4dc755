"""The numbers at keys of a config, and configs with some of these numbers changed."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from rbstab.config.elements import declarations_of, gain_path, initial_path, kind_of
from rbstab.config.load import changed_config, resolved
from rbstab.config.schema import Config
from rbstab.config.section import FrozenMapping, Section
from rbstab.config.sections.angles import NumberInDegrees, VectorInDegrees
from rbstab.config.source import Path, key_of
from rbstab.config.units import DEGREES, NumberKey, in_degrees, names_in, parse_key, unit_of
from rbstab.elements.declarations import is_initial
from rbstab.elements.registry import GAINS
from rbstab.mechanics.numbers import Number


class Entry(NamedTuple):
    """An independent number of a config.

    Attributes:
        key: The key, as in messages and `--set`.
        value: The number.
        paths: The paths of the number. An off-diagonal entry of a symmetric matrix has two paths;
            `key` is the key of the first.
    """

    key: str
    value: float
    paths: tuple[Path, ...]


def unit_at(config: Config, key: str) -> str:
    """Return the unit of a key of a config; empty if it has none."""
    path = parse_key(key) or ()
    elements = [config.elements[name] for name in path[1:2] if name in config.elements]
    return unit_of(key_of(names_in(path)), set(map(kind_of, elements)))


def unit_problem(config: Config, key: NumberKey) -> tuple[str, str] | None:
    """Return what is wrong and expected, if a config has another unit at a key; None if not.

    Raises:
        LookupError: The config has no such key.
    """
    if key.degrees and not unit_at(config, key.text).startswith(DEGREES):
        return "is not an angle", f"expected {key_of(key.path)}"
    value = value_at(config, names_in(key.path))
    if not key.degrees and isinstance(value, VectorInDegrees | NumberInDegrees):
        return in_degrees(key)
    return None


def entries_of(config: Config) -> tuple[Entry, ...]:
    """Return the numbers of the gains, the body and the initial state, in this order.

    A diagonal has three entries and a symmetric matrix six: an off-diagonal entry and its mirror
    image are one number.
    """
    gains: list[Path] = [("controller", name) for name in GAINS if hasattr(config.controller, name)]
    for name, section in config.elements.items():
        gains += [gain_path(name, section, gain) for gain in declarations_of(section).gains]
        signal = getattr(section, "signal", None)
        gains += [
            ("elements", name, "signal", key)
            for key in getattr(type(signal), "model_fields", ())
            if isinstance(getattr(signal, key), float)
        ]
    body = [("body", name) for name in type(config.body).model_fields]
    initial: list[Path] = [
        ("initial", name)
        for name in type(config.initial).model_fields
        if isinstance(getattr(config.initial, name), tuple)
    ]
    for name, section in config.elements.items():
        initial += [initial_path(name, section, own) for own in declarations_of(section).states]
    return tuple(
        entry for path in (*gains, *body, *initial) for entry in entries_under(config, path)
    )


def is_of_initial_state(path: Path) -> bool:
    """Return whether a path is that of a number of the initial state, or of such numbers.

    The elements' own states start with the values in the sections of the elements.
    """
    if path[0] == "elements":
        return any(is_initial(str(part)) for part in path[2:4])
    return path[0] == "initial"


def entries_under(config: Config, path: Path) -> tuple[Entry, ...]:
    """Return the independent numbers at a path and below it."""
    value = value_at(config, path)
    if not isinstance(value, tuple):
        return (Entry(key_of(path), value, (path,)),)
    if not isinstance(value[0], tuple):
        return tuple(Entry(key_of((*path, i)), x, ((*path, i),)) for i, x in enumerate(value))
    entries = []
    for i in range(3):
        for j in range(i, 3):
            own_path, mirrored_path = (*path, i, j), (*path, j, i)
            paths = (own_path,) if i == j else (own_path, mirrored_path)
            entries.append(Entry(key_of(own_path), value[i][j], paths))
    return tuple(entries)


def value_at(owner: Any, path: Path) -> Any:
    """Return the value at a path of a config, or of plain data.

    Raises:
        LookupError: There is no such path.
    """
    value: Any = owner
    for part in path:
        if isinstance(part, int):
            if not (isinstance(value, tuple | list) and part < len(value)):
                raise LookupError(key_of(path))
            value = value[part]
        elif isinstance(value, Section) and part in type(value).model_fields:
            value = getattr(value, part)
        elif isinstance(value, dict) and part in value:
            value = value[part]
        else:
            raise LookupError(key_of(path))
    return value


def numbers_below(owner: Any, path: Path) -> Iterator[tuple[Path, float]]:
    """Yield the path and the value of each number at a path and below it: of all matrix entries.

    Raises:
        LookupError: There is no such path, or it holds no numbers.
    """
    value = value_at(owner, path)
    if isinstance(value, tuple | list):
        for index in range(len(value)):
            yield from numbers_below(owner, (*path, index))
    elif isinstance(value, bool) or not isinstance(value, int | float):
        raise LookupError(key_of(path))
    else:
        yield path, value


def with_numbers(config: Config, numbers: Mapping[Path, float]) -> Config:
    """Return the config with some of its numbers replaced, validated.

    Raises:
        ConfigError: It is not valid.
    """
    data = resolved(config)
    for path, number in numbers.items():
        value_at(data, path[:-1])[path[-1]] = number
    return changed_config(config, data)


def shifted(config: Config, shift: Mapping[Path, Number]) -> Config:
    """Return the config with a shift added to some of its numbers, without validation.

    The shift may be complex. Then every quantity computed from the config is complex, and its
    imaginary part is a derivative (see `derivatives.jacobian`).

    Args:
        config: The config.
        shift: The shift of each number, by path.
    """
    return replaced(config, {path: value_at(config, path) + delta for path, delta in shift.items()})


def replaced(config: Config, numbers: Mapping[Path, Number]) -> Config:
    """Return the config with some of its numbers replaced, without validation.

    Args:
        config: The config.
        numbers: The new numbers by path; any kind of number.
    """
    changed: Config = _replaced(config, (), numbers)
    return changed


def _replaced(value: Any, path: Path, numbers: Mapping[Path, Number]) -> Any:
    if path in numbers:
        return numbers[path]
    children = {key[len(path)] for key in numbers if key[: len(path)] == path}
    if not children:
        return value
    if isinstance(value, tuple):
        return tuple(_replaced(entry, (*path, i), numbers) for i, entry in enumerate(value))
    if isinstance(value, dict):
        return FrozenMapping(
            {name: _replaced(entry, (*path, name), numbers) for name, entry in value.items()}
        )
    changes = {
        part: _replaced(getattr(value, str(part)), (*path, part), numbers) for part in children
    }
    return value.model_copy(update=changes)
