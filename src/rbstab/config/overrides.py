"""Replacing single values from the command line: `--set body.mass=50`."""

from collections.abc import Iterable
from typing import Any

from rbstab.config.errors import ConfigError, Location
from rbstab.config.numbers import replaced, unit_at, value_or_none
from rbstab.config.schema import NO_VARIANT, VARIANTS, model_of, variant_of
from rbstab.config.source import MAX_DEPTH, Path, Source, key_of, parse_source
from rbstab.config.units import DEGREES, NumberKey, in_degrees, names_in, number_key, parse_key
from rbstab.files.text import shortened


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
    where = Location(f"--set {shortened(key)}")
    path, number = parse_key(key), number_key(key)
    if not equals or path is None or number is None or len(path) > MAX_DEPTH:
        expected = "expected key=value with a key like body.inertia[0]"
        raise ConfigError.at(where, "is not an assignment of a key", expected)
    in_radians = _is_in_radians(source.data, number)
    path = number.path if in_radians else path
    parsed = parse_source(value, where.source, column_offset=len(key) + 1, path=path)
    source.problems += parsed.problems
    data = _scaled(parsed.data, number.factor) if in_radians else parsed.data
    for depth in range(1, len(path)):
        if value_or_none(source.data, path[:depth]) is None:
            _set(source, path[:depth], _default(source.data, path[:depth]), where)
    _set(source, path, data, where)
    source.values |= parsed.values
    source.keys |= parsed.keys


def _is_in_radians(data: Any, key: NumberKey) -> bool:
    """Whether data have an angle in radians, or none, at a key that is in degrees."""
    is_angle = key.degrees and unit_at(data, key.text).startswith(DEGREES)
    return is_angle and not isinstance(value_or_none(data, names_in(key.path)), dict)


def _scaled(value: Any, factor: float) -> Any:
    """Return numbers times a factor; the validation reports what is no number."""
    if isinstance(value, list):
        return [_scaled(entry, factor) for entry in value]
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return value * factor if is_number else value


def _set(source: Source, path: Path, value: Any, where: Location) -> None:
    """Set a value of a source, with the option as its location."""
    try:
        source.data = replaced(source.data, {path: value})
    except LookupError:
        problem = "does not exist", "expected a key of the config"
        above = value_or_none(source.data, path[:-1])
        if isinstance(above, dict) and DEGREES in above:
            problem = in_degrees(NumberKey(path))
        raise ConfigError.at(where, *problem, key_of(path)) from None
    for table in (source.values, source.keys):
        for old in [old for old in table if old[: len(path)] == path]:
            del table[old]
        table[path] = where


def _default(data: Any, path: Path) -> Any:
    """Return the initial value of a missing key: its default as a list, else an empty mapping."""
    variant = variant_of(data)
    is_variant = variant in (*VARIANTS, NO_VARIANT)
    field = model_of(variant).model_fields.get(str(path[0])) if is_variant else None
    default = None if field is None else value_or_none(field.default, path[1:])
    return list(default) if isinstance(default, tuple) else {}
