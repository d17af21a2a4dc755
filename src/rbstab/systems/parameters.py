"""The parameters of a system as named arrays: reading them, and replacing their values.

Every numeric field of a body, an element or coordinates is a parameter. Its name consists of the
owner and the field: `body.mass`, `connector.K_c`, `anchor`. A compiled engine replaces all
parameters by its own symbols, traces the equations once, and then integrates any system with the
same `structure`.
"""

from collections.abc import Callable, Hashable, Iterator
from dataclasses import fields, is_dataclass, replace
from functools import cache
from numbers import Number
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

Transform = Callable[[str, Array], Array]

_cached: WeakKeyDictionary[System, dict[str, Array]] = WeakKeyDictionary()
"""The parameters of the systems in memory, which do not change. A run asks for those of one system
several times, and finding them takes longer than some steps."""


def parameters(system: System) -> dict[str, Array]:
    """Return the parameters by name, in the order of the fields; a number has shape ().

    Raises:
        ValueError: Two parameters have the same name, because two elements have the same name.
    """
    by_name = _cached.get(system)
    if by_name is None:
        arrays: dict[str, Array] = {}

        def add(name: str, value: Array) -> Array:
            if name in arrays:
                raise ValueError(f"two elements have the same name: {name} exists twice")
            return arrays.setdefault(name, value)

        map_parameters(system, add)
        by_name = _cached[system] = arrays
    return by_name.copy()


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
    kinds = [(type(owner), *_functions_and_parts(owner)) for owner in owners]
    shapes = [(name, value.shape) for name, value in parameters(system).items()]
    return tuple(kinds), tuple(shapes)


def _functions_and_parts(owner: Any) -> Iterator[Hashable]:
    """Yield the fields that are functions, not parameters; then the types of dataclass fields."""
    values = [getattr(owner, field) for field in _field_names(owner.__class__)]
    yield from filter(callable, values)
    # Such as the type of a signal.
    yield from (value.__class__ for value in values if is_dataclass(value))


def _mapped(value: Any, name: str, transform: Transform) -> Any:
    """Return a value with each parameter in it replaced; `name` is the name of the value."""
    if isinstance(value, np.ndarray):
        return transform(name, value)
    if isinstance(value, tuple):
        return tuple(_mapped(entry, name, transform) for entry in value)
    names = _field_names(value.__class__)
    if names:
        owner = _owner(value, name)
        changes = {
            field: _mapped(getattr(value, field), _join(owner, field), transform) for field in names
        }
        return replace(value, **changes)
    return value if _is_kept(value) else transform(name, _number(value))[()]


@cache
def _field_names(kind: type) -> tuple[str, ...]:
    """Return the names of the fields of a dataclass; () for any other type."""
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else ()


def _owner(value: Any, name: str) -> str:
    """Return the first part of the names of the parameters in a dataclass."""
    return name if isinstance(value, System) else getattr(value, "name", name)


def _is_kept(value: Any) -> bool:
    """Return whether a value is no parameter: a function, a text, or a dataclass of no fields."""
    return callable(value) or isinstance(value, str) or is_dataclass(value)


def _number(value: Any) -> Array:
    """Return a single number as an array of shape ()."""
    if isinstance(value, Number):
        return np.array(value, dtype=complex if isinstance(value, complex) else float)
    # The rest are numbers that Python does not recognize as such, for example symbols.
    return np.array(value, dtype=object)


def _join(owner: str, field: str) -> str:
    return f"{owner}.{field}" if owner else field
