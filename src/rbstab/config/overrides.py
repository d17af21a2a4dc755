"""Replacing single values from the command line: `--set body.mass=50`."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from rbstab.config.errors import ConfigError, ConfigProblem, Location, shortened
from rbstab.config.schema import NO_VARIANT, VARIANTS, model_of, variant_of
from rbstab.config.source import MAX_DEPTH, Path, Source, key_of, parse_source
from rbstab.config.units import (
    DEGREES,
    Kind,
    NumberKey,
    in_degrees,
    names_in,
    number_key,
    parse_key,
    unit_of,
)
from rbstab.elements.registry import SELECTORS


def override(source: Source, assignments: Iterable[str]) -> None:
    """Replace values of a source in place.

    Those that are wrong are left out. Their problems are added to those of the source, so that they
    are reported together with the problems of the data: a text is not an assignment, its value is
    not YAML, or its key does not exist.

    Args:
        source: The source.
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
    path = parse_key(key)
    if not equals or not key:
        raise _error(name, 1, "", "is not an assignment", "expected key=value")
    if path is None or len(path) > MAX_DEPTH:
        raise _error(
            name, 1, "", "is not a key", "expected key=value with a key like body.inertia[0]"
        )
    parsed = parse_source(value, name, column_offset=len(key) + 1)
    source.problems += [
        replace(problem, key=f"{key}.{problem.key}" if problem.key else key)
        for problem in parsed.problems
    ]
    read, data = number_key(key), parsed.data
    if read is not None and read.degrees and _is_in_radians(source, read):
        path, data = read.path, _times(data, read.factor)
    container: Any = _container(source, path, name)
    last = path[-1]
    in_list = isinstance(container, list) and isinstance(last, int) and last < len(container)
    if not (in_list or (isinstance(container, dict) and isinstance(last, str))):
        if isinstance(container, dict) and DEGREES in container:
            raise _error(name, 1, key, *in_degrees(NumberKey(path)))
        raise _error(name, 1, key, "does not exist", "expected a key of the config")
    for table in (source.values, source.keys):
        for old in [old for old in table if old[: len(path)] == path]:
            del table[old]
    container[last] = data
    source.keys[path] = Location(name)
    for relative_path, location in parsed.values.items():
        source.values[path + relative_path] = location
    for relative_path, location in parsed.keys.items():
        source.keys[path + relative_path] = location


def _is_in_radians(source: Source, key: NumberKey) -> bool:
    """Whether the source has an angle in radians, or none, at a key that is in degrees."""
    names, elements = names_in(key.path), source.data.get("elements")
    element = elements.get(names[1]) if isinstance(elements, dict) else None
    kinds = set()
    if isinstance(element, dict) and isinstance(kind := element.get("kind"), str):
        kinds = {Kind(kind, element.get(SELECTORS.get(kind, "")))}
    here: Any = source.data
    for part in names:
        here = here.get(part) if isinstance(here, dict) else None
    is_angle = unit_of(f"{key_of(names)}.{DEGREES}", kinds).startswith(DEGREES)
    return is_angle and not isinstance(here, dict)


def _times(value: Any, factor: float) -> Any:
    """Return numbers times a factor; the validation reports what is no number."""
    if isinstance(value, list):
        return [_times(entry, factor) for entry in value]
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return value * factor if is_number else value


def _container(source: Source, path: Path, name: str) -> Any:
    """Return the mapping or list that contains the last part of a path; create missing ones."""
    value = source.data
    for depth, part in enumerate(path[:-1]):
        if isinstance(value, dict) and isinstance(part, str):
            if part not in value:
                value[part] = _default(source, path[: depth + 1])
                source.keys[path[: depth + 1]] = source.values[path[: depth + 1]] = Location(name)
            value = value[part]
        elif isinstance(value, list) and isinstance(part, int) and part < len(value):
            value = value[part]
        else:
            key = key_of(path[: depth + 1])
            raise _error(name, 1, key, "does not exist", "expected a key of the config")
    return value


def _default(source: Source, path: Path) -> Any:
    """Return the initial value of a missing key: its default as a list, else an empty mapping."""
    variant = variant_of(source.data)
    value: Any = None
    if isinstance(variant, str) and variant in (*VARIANTS, NO_VARIANT):
        value = model_of(variant)
    for part in path:
        if isinstance(value, type):
            field = getattr(value, "model_fields", {}).get(part)
            value = field.default if field is not None else None
        else:
            value = getattr(value, str(part), None)
    return list(value) if isinstance(value, tuple) else {}


def _error(name: str, column: int, key: str, problem: str, expected: str) -> ConfigError:
    return ConfigError([ConfigProblem(Location(name, 1, column), key, problem, expected)])
