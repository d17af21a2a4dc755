"""Replacing single values from the command line: `--set body.mass=50`."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from rbstab.config.errors import ConfigError, Location, shortened
from rbstab.config.numbers import replaced, unit_at, value_at
from rbstab.config.schema import NO_VARIANT, VARIANTS, model_of, variant_of
from rbstab.config.source import MAX_DEPTH, Path, Source, key_of, parse_source
from rbstab.config.units import DEGREES, NumberKey, in_degrees, names_in, number_key, parse_key


def override(source: Source, assignments: Iterable[str]) -> None:
    """Replace values of a source.

    Those that are wrong are left out. Their problems are added to those of the source, so that they
    are reported together with the problems of the data: a text is not an assignment, its value is
    not YAML, or its key does not exist.

    Args:
        source: The source; its data are replaced.
        assignments: Texts `key=value` with a YAML value, such as `controller.K_t[0]=5000` or
            `initial.orientation=[0, 0.1, 0]`.
    """
    for text in assignments:
        try:
            _assign(source, text)
        except ConfigError as error:
            source.problems += error.problems


def _assign(source: Source, text: str) -> None:
    key, equals, value = text.partition("=")
    name = f"--set {shortened(key)}"
    if not equals or not key:
        raise ConfigError.at(Location(name), "is not an assignment", "expected key=value")
    path, number = parse_key(key), number_key(key)
    if path is None or number is None or len(path) > MAX_DEPTH:
        expected = "expected key=value with a key like body.inertia[0]"
        raise ConfigError.at(Location(name), "is not a key", expected)
    parsed = parse_source(value, name, column_offset=len(key) + 1)
    source.problems += [
        replace(problem, key=f"{key}.{problem.key}" if problem.key else key)
        for problem in parsed.problems
    ]
    data = parsed.data
    if _is_in_radians(source.data, number):
        path, data = number.path, _scaled(data, number.factor)
    for depth in range(1, len(path)):
        if _found(source.data, path[:depth]) is None:
            _set(source, path[:depth], _default(source.data, path[:depth]), name)
    _set(source, path, data, name)
    source.values |= {path + inner: place for inner, place in parsed.values.items()}
    source.keys |= {path + inner: place for inner, place in parsed.keys.items()}


def _is_in_radians(data: Any, key: NumberKey) -> bool:
    """Whether data have an angle in radians, or none, at a key that is in degrees."""
    is_angle = key.degrees and unit_at(data, key.text).startswith(DEGREES)
    return is_angle and not isinstance(_found(data, names_in(key.path)), dict)


def _found(data: Any, path: Path) -> Any:
    try:
        return value_at(data, path)
    except LookupError:
        return None


def _scaled(value: Any, factor: float) -> Any:
    """Return numbers times a factor; the validation reports what is no number."""
    if isinstance(value, list):
        return [_scaled(entry, factor) for entry in value]
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return value * factor if is_number else value


def _set(source: Source, path: Path, value: Any, name: str) -> None:
    """Set a value of a source, with the option as its location."""
    try:
        source.data = replaced(source.data, {path: value})
    except LookupError:
        problem = "does not exist", "expected a key of the config"
        above = _found(source.data, path[:-1])
        if isinstance(above, dict) and DEGREES in above:
            problem = in_degrees(NumberKey(path))
        raise ConfigError.at(Location(name), *problem, key_of(path)) from None
    for table in (source.values, source.keys):
        for old in [old for old in table if old[: len(path)] == path]:
            del table[old]
    source.keys[path] = source.values[path] = Location(name)


def _default(data: Any, path: Path) -> Any:
    """Return the initial value of a missing key: its default as a list, else an empty mapping."""
    variant = variant_of(data)
    if variant in (*VARIANTS, NO_VARIANT) and path[0] in model_of(variant).model_fields:
        default = _found(model_of(variant).model_fields[str(path[0])].default, path[1:])
        return list(default) if isinstance(default, tuple) else {}
    return {}
