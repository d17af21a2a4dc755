"""The numbers at keys of a config, or of its plain data: their values and units, set and scaled.

All that changes a number of a config does it here: `--set`, sweeps, `--within`, `--along`, `tune`
and sensitivities. A path names a value in a config and in its plain data alike.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from rbstab.config.elements import declarations_of, parameter_path
from rbstab.config.schema import Config
from rbstab.config.section import Section
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


def value_at(owner: Any, path: Path) -> Any:
    """Return the value at a path of a config, or of plain data.

    Raises:
        LookupError: There is no such path; its text is the first key that is missing.
    """
    value: Any = owner
    for depth, part in enumerate(path, start=1):
        inner: Any = vars(value) if isinstance(value, Section) else value
        is_index = isinstance(inner, tuple | list) and isinstance(part, int) and part < len(inner)
        if not is_index and not (isinstance(inner, dict) and part in inner):
            raise LookupError(key_of(path[:depth]))
        value = inner[part]
    return value


def value_or_none(owner: Any, path: Path) -> Any:
    """Return the value at a path of a config, or of plain data; None if there is no such path."""
    try:
        return value_at(owner, path)
    except LookupError:
        return None


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


def changed_numbers(
    owner: Any, key: NumberKey, value: Any, *, scale: bool = False
) -> dict[Path, Any]:
    """Return the new values of all numbers at a key, by path.

    Args:
        owner: The config, or its plain data.
        key: The key.
        value: What replaces each number, in the unit of the key; a number or an array.
        scale: Whether it multiplies each number instead.

    Raises:
        LookupError: There is no such key, or it holds no numbers.
    """
    numbers = numbers_below(owner, key.path)
    return {path: value * (number if scale else key.factor) for path, number in numbers}


def replaced(owner: Any, values: Mapping[Path, Any]) -> Any:
    """Return a config, or plain data, with other values at some paths, without validation.

    The numbers may be of any kind. With complex ones, every quantity computed from the config is
    complex, and its imaginary part is a derivative (see `derivatives.jacobian`).

    Raises:
        LookupError: There is no such path; a mapping of plain data takes new keys.
    """
    if () in values:
        return values[()]
    inner: dict[Any, dict[Path, Any]] = defaultdict(dict)
    for (part, *rest), value in values.items():
        inner[part][tuple(rest)] = value
    changes = {
        part: below[()] if () in below else replaced(value_at(owner, (part,)), below)
        for part, below in inner.items()
    }
    if isinstance(owner, Section):
        return owner.model_copy(update=changes)
    if isinstance(owner, dict) and not any(isinstance(part, int) for part in changes):
        return type(owner)({**owner, **changes})
    entries = dict(enumerate(owner)) if isinstance(owner, tuple | list) else {}
    if not changes.keys() <= entries.keys():
        raise LookupError(key_of(next(iter(values))))
    return (list if isinstance(owner, list) else tuple)((entries | changes).values())


def shifted(config: Config, shift: Mapping[Path, Number]) -> Config:
    """Return the config with a shift added to some of its numbers, as `replaced`."""
    numbers = {path: value_at(config, path) + change for path, change in shift.items()}
    changed: Config = replaced(config, numbers)
    return changed


def entries_of(config: Config) -> tuple[Entry, ...]:
    """Return the numbers of the gains, the body and the initial state, in this order.

    A diagonal has three entries and a symmetric matrix six: an off-diagonal entry and its mirror
    image are one number.
    """
    gains = controller_gains(config)
    own_states: list[Path] = []
    for name, section in config.elements.items():
        declared = declarations_of(section)
        gains += [parameter_path(name, section, gain.place) for gain in declared.gains]
        signal = getattr(section, "signal", None)
        numbers = [key for key, value in signal or () if isinstance(value, float)]
        gains += [("elements", name, "signal", key) for key in numbers]
        states = [parameter_path(name, section, state.initial_key) for state in declared.states]
        own_states += [path for path in states if value_or_none(config, path) is not None]
    body = [("body", name) for name in type(config.body).model_fields]
    start = [("initial", name) for name, value in config.initial if isinstance(value, tuple)]
    paths = (*gains, *body, *start, *own_states)
    return tuple(entry for path in paths for entry in entries_under(config, path))


def controller_gains(config: Config) -> list[Path]:
    """Return the paths of the gains of the controller of a config."""
    paths: list[Path] = [("controller", *place.split(".")) for place in GAINS]
    return [path for path in paths if value_or_none(config, path) is not None]


def entries_under(config: Config, path: Path) -> tuple[Entry, ...]:
    """Return the independent numbers at a path and below it.

    Raises:
        LookupError: There is no such path, or it holds no numbers.
    """
    places: dict[tuple[Any, ...], list[tuple[Path, float]]] = defaultdict(list)
    for place in numbers_below(config, path):
        # An entry of a symmetric matrix and its mirror image have the same indices.
        places[tuple(sorted(place[0][len(path) :], key=str))].append(place)
    return tuple(
        Entry(key_of(group[0][0]), group[0][1], tuple(place for place, _ in group))
        for group in places.values()
    )


def keys_of(config: Config) -> dict[str, list[float]]:
    """Return the keys of the values that `entries_of` takes apart, and the numbers of each."""
    numbers: dict[str, list[float]] = defaultdict(list)
    for entry in entries_of(config):
        numbers[entry.key.partition("[")[0]].append(entry.value)
    return numbers


def is_of_initial_state(path: Path) -> bool:
    """Return whether a path is that of a number of the initial state, or of such numbers.

    The elements' own states start with the values in the sections of the elements.
    """
    if path[0] == "elements":
        return any(is_initial(str(part)) for part in path[2:4])
    return path[0] == "initial"


def unit_at(owner: Any, key: str) -> str:
    """Return the unit of a key of a config, or of plain data; empty if it has none."""
    path = parse_key(key) or ()
    element = value_or_none(owner, path[:2])
    data = element.model_dump(by_alias=True) if isinstance(element, Section) else element
    return unit_of(key_of(names_in(path)), [data])


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
