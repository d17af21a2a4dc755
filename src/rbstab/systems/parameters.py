"""The parameters of a system as named arrays: reading them, and replacing their values.

Every numeric field of a body, an element or coordinates is a parameter. Its name consists of the
owner and the field: `body.mass`, `connector.K_c`, `anchor`. A compiled engine replaces all
parameters by its own symbols, traces the equations once, and then integrates any system with the
same `structure`.
"""

from collections.abc import Callable, Hashable, Iterator
from dataclasses import fields, is_dataclass, replace
from numbers import Number
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

Transform = Callable[[str, Array], Array]


def parameters(system: System) -> dict[str, Array]:
    """Return the parameters by name, in the order of the fields; a number has shape ().

    Raises:
        ValueError: Two parameters have the same name, because two elements have the same name.
    """
    by_name: dict[str, Array] = {}

    def collect(name: str, value: Array) -> Array:
        if name in by_name:
            raise ValueError(f"two elements have the same name: {name} exists twice")
        by_name[name] = value
        return value

    map_parameters(system, collect)
    return by_name


def map_parameters(system: System, transform: Transform) -> System:
    """Return the system with each parameter replaced by `transform(name, value)`.

    Args:
        system: The system.
        transform: A function of a name and an array that returns an array of the same shape.
    """
    mapped: System = _mapped(system, "", transform)
    return mapped


def structure(system: System) -> Hashable:
    """Return a key for the equations of a system, independent of parameter values.

    Two systems with equal structure have the same equations, states and parameter names.
    """
    owners = (system.coordinates, *system.elements)
    kinds = [(type(owner), *_functions(owner), *_parts(owner)) for owner in owners]
    shapes = [(name, np.shape(value)) for name, value in parameters(system).items()]
    return tuple(kinds), tuple(shapes)


def _functions(owner: Any) -> Iterator[Callable[..., Any]]:
    """Yield the fields of an element or of coordinates that are functions, not parameters."""
    return filter(callable, (getattr(owner, field.name) for field in fields(owner)))


def _parts(owner: Any) -> Iterator[type]:
    """Yield the types of the fields that are dataclasses themselves, such as a signal."""
    values = (getattr(owner, field.name) for field in fields(owner))
    return (type(value) for value in values if is_dataclass(value))


def _mapped(value: Any, name: str, transform: Transform) -> Any:
    """Return a value with each parameter in it replaced; `name` is the name of the value."""
    if isinstance(value, np.ndarray):
        return transform(name, value)
    if isinstance(value, Number):
        kind = complex if isinstance(value, complex) else float
        return transform(name, np.array(value, dtype=kind))[()]
    if isinstance(value, tuple):
        return tuple(_mapped(entry, name, transform) for entry in value)
    if is_dataclass(value) and not isinstance(value, type):
        owner = name if isinstance(value, System) else getattr(value, "name", name)
        changes = {
            field.name: _mapped(getattr(value, field.name), _join(owner, field.name), transform)
            for field in fields(value)
        }
        return replace(value, **changes)
    if callable(value) or isinstance(value, str):
        return value
    # The rest are numbers that Python does not recognize as such, for example symbols.
    return transform(name, np.array(value, dtype=object))[()]


def _join(owner: str, field: str) -> str:
    return f"{owner}.{field}" if owner else field
