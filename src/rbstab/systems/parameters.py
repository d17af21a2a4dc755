"""The parameters of a system as named arrays, to be read, replaced, or turned into symbols.

Every field of a body, an element or a choice of coordinates that holds numbers is a parameter,
named by where it stands: `body.mass`, `connector.K_c`, `anchor`. A compiled engine replaces all of
them by its own symbols, traces the equations once, and then runs any system of the same
`structure`.
"""

from collections.abc import Callable, Hashable
from dataclasses import fields, is_dataclass, replace
from numbers import Number
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

Transform = Callable[[str, Array], Array]


def parameters(system: System) -> dict[str, Array]:
    """The parameters by name, in the order of the fields; a number has shape ().

    Raises:
        ValueError: Two parameters have one name, because two elements have.
    """
    found: dict[str, Array] = {}

    def note(name: str, value: Array) -> Array:
        if name in found:
            raise ValueError(f"two elements have the same name: {name} stands twice")
        found[name] = value
        return value

    map_parameters(system, note)
    return found


def map_parameters(system: System, transform: Transform) -> System:
    """The same system with each parameter replaced by `transform(name, value)`.

    Args:
        system: The system.
        transform: Takes a name and an array, and returns an array of the same shape.
    """
    mapped: System = _mapped(system, "", transform)
    return mapped


def structure(system: System) -> Hashable:
    """What the equations of a system depend on besides the values of its parameters.

    Two systems of equal structure have the same equations, states, and parameter names.
    """
    kinds = [type(system.coordinates), *(type(element) for element in system.elements)]
    shapes = [(name, np.shape(value)) for name, value in parameters(system).items()]
    return tuple(kinds), tuple(shapes)


def _mapped(value: Any, name: str, transform: Transform) -> Any:
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
    if callable(value):
        return value
    # What is left is a number of a kind that Python does not know as one, such as a symbol.
    return transform(name, np.array(value, dtype=object))[()]


def _join(owner: str, field: str) -> str:
    return f"{owner}.{field}" if owner else field
