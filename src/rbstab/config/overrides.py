"""Single values replaced from the command line: `--set body.mass=50`."""

import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from rbstab.config.errors import ConfigError, Location, Problem
from rbstab.config.schema import VARIANTS
from rbstab.config.source import Path, Source, key_of, parse_source

_PART = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)|\[([0-9]{1,6})\]")


def override(source: Source, assignments: Iterable[str]) -> None:
    """Sets values of a source in place, each from a text `key=value` with a YAML value.

    Args:
        source: What was read.
        assignments: Texts such as `controller.K_t[0]=5000` or `initial.orientation=[0, 0.1, 0]`.

    Raises:
        ConfigError: A text is no assignment, its value is not YAML, or its key leads nowhere.
    """
    problems: list[Problem] = []
    for text in assignments:
        try:
            _assign(source, text)
        except ConfigError as error:
            problems += error.problems
    if problems:
        raise ConfigError(problems)


def _assign(source: Source, text: str) -> None:
    key, equals, value = text.partition("=")
    name = f"--set {key}"
    path = parse_key(key)
    if not equals or not key:
        raise _error(name, 1, "", "is no assignment", "expected key=value")
    if path is None:
        raise _error(name, 1, "", "is no key", "expected key=value with a key as body.inertia[0]")
    parsed = parse_source(value, name, column_offset=len(key) + 1)
    source.problems += [
        replace(problem, key=f"{key}.{problem.key}" if problem.key else key)
        for problem in parsed.problems
    ]
    container: Any = _container(source, path, name)
    last = path[-1]
    listed = isinstance(container, list) and isinstance(last, int) and last < len(container)
    if not (listed or (isinstance(container, dict) and isinstance(last, str))):
        raise _error(name, 1, key, "leads nowhere", "expected a key of the config")
    container[last] = parsed.data
    source.forget(path)
    source.keys[path] = Location(name)
    for below, where in parsed.values.items():
        source.values[path + below] = where
    for below, where in parsed.keys.items():
        source.keys[path + below] = where


def parse_key(text: str) -> Path | None:
    """The path that a dotted key names (the inverse of `key_of`), or None."""
    path: list[str | int] = []
    for match in _PART.finditer(text):
        word, index = match.groups()
        path.append(word if word is not None else int(index))
    return tuple(path) if path and key_of(tuple(path)) == text else None


def _container(source: Source, path: Path, name: str) -> Any:
    """The mapping or list that holds the last part of a path; missing mappings are made."""
    here = source.data
    for depth, part in enumerate(path[:-1]):
        if isinstance(here, dict) and isinstance(part, str):
            if part not in here:
                here[part] = _default(source, path[: depth + 1])
                source.keys[path[: depth + 1]] = source.values[path[: depth + 1]] = Location(name)
            here = here[part]
        elif isinstance(here, list) and isinstance(part, int) and part < len(here):
            here = here[part]
        else:
            key = key_of(path[: depth + 1])
            raise _error(name, 1, key, "leads nowhere", "expected a key of the config")
    return here


def _default(source: Source, path: Path) -> Any:
    """What a key is where it is not given: its default as a list, else an empty mapping."""
    controller = source.data.get("controller")
    variant = controller.get("variant") if isinstance(controller, dict) else None
    here: Any = VARIANTS.get(variant) if isinstance(variant, str) else None
    for part in path:
        if isinstance(here, type):
            field = getattr(here, "model_fields", {}).get(part)
            here = field.default if field is not None else None
        else:
            here = getattr(here, str(part), None)
    return list(here) if isinstance(here, tuple) else {}


def _error(name: str, column: int, key: str, problem: str, expected: str) -> ConfigError:
    return ConfigError([Problem(Location(name, 1, column), key, problem, expected)])
