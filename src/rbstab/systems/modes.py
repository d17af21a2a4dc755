"""The modes of the elements of a system: reading them, setting them, and those of a state.

Between two switches the modes are constant, and the equations are smooth (`Element.guards`). The
modes of a system are one tuple of 0.0 and 1.0: those of each element, in the order of the elements.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from rbstab.mechanics.derivatives import derivative_along
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.states import F_OF_W
from rbstab.systems.impact import resting_side, stop_of
from rbstab.systems.system import System

Modes = tuple[float, ...]


def has_modes(system: System) -> bool:
    """Return whether an element of a system switches."""
    return any(element.mode_count for element in system.elements)


def modes_of(system: System) -> Modes:
    """Return the modes of a system."""
    elements: list[Any] = [element for element in system.elements if element.mode_count]
    return tuple(float(mode) for element in elements for mode in element.mode)


def mode_owners(system: System) -> tuple[str, ...]:
    """Return the name of the element of each mode."""
    return tuple(element.name for element in system.elements for _ in range(element.mode_count))


def first_mode(system: System, element: Any) -> int:
    """Return the index of the first mode of an element among the modes of a system."""
    return sum(earlier.mode_count for earlier in system.elements[: system.elements.index(element)])


NO_STATE = -1
"""The place of a rate that is no state."""


def rate_places(system: System) -> Array:
    """Return the places in the state vector of the rates of event functions, shape (modes,).

    They are those of F, for event functions that are states (`Element.exact_guards`); for others
    `NO_STATE`.
    """
    places = [np.zeros(0, dtype=int)]
    for element in system.elements:
        axes = np.arange(element.mode_count) % 3
        exact = element.exact_guards
        places.append(F_OF_W.start + axes if exact else np.full(len(axes), NO_STATE))
    return np.concatenate(places)


def mode_parameters(system: System) -> frozenset[str]:
    """Return the names of the parameters that are modes (see `systems.parameters`)."""
    return frozenset(f"{element.name}.mode" for element in system.elements if element.mode_count)


def with_modes(system: System, modes: Modes) -> System:
    """Return a system in other modes."""
    changed, begin = [], 0
    for element in system.elements:
        end = begin + element.mode_count
        given: Any = element
        changed.append(replace(given, mode=np.array(modes[begin:end])) if end > begin else element)
        begin = end
    return replace(system, elements=tuple(changed))


def with_changed(system: System, places: Any, values: Any) -> System:
    """Return a system in which the modes at some indices have other values.

    Args:
        system: The system.
        places: The indices of the modes, as numpy takes them.
        values: Their values, or the value of all.
    """
    modes = np.array(modes_of(system))
    modes[places] = values
    return with_modes(system, tuple(modes.tolist()))


def guards_at(system: System, y: Array, time: Number = 0.0) -> Array:
    """Return the event functions of all elements at a state, in the order of the modes.

    Those of an element that `holds` or `slides` depend on the loads, and so on the time.

    Args:
        system: The system.
        y: The state, of any kind of number.
        time: The time, s.
    """
    motion, pairs = system.acting(y, time)
    guards = [element.guards(motion, states) for element, states in pairs if element.mode_count]
    return np.concatenate([np.zeros(0), *guards])


def with_modes_at(system: System, y: Array, time: float = 0.0) -> System:
    """Return a system in the modes that belong to a state; itself if none of its elements switches.

    A mode is 1 where the real part of its event function is positive. A mode of a stop is 1 if the
    body rests there. No axis of a tie is held.

    Args:
        system: The system, in any modes.
        y: The state, of floats, of complex numbers, or of numbers that `float` accepts.
        time: The time, s.
    """
    if not has_modes(system):
        return system
    if any(element.slides for element in system.elements):
        # A tie that holds an axis has other event functions.
        system = with_modes(system, (0.0,) * len(modes_of(system)))
    system = with_modes(system, tuple(float(_real(g) > 0) for g in guards_at(system, y, time)))
    return _with_stop_at(system, y, time)


def with_first_modes(system: System, y: Array, time: float = 0.0) -> System:
    """Return a system in the modes in which a motion begins; itself if none of them switches.

    They are those of the state; where an event function is zero, its rate decides. If that is zero
    as well, the mode is 0.

    Args:
        system: The system, in any modes.
        y: The state at the start, of floats.
        time: The time of the start, s.
    """
    system = with_modes_at(system, y, time)
    if not has_modes(system):
        return system
    g = guards_at(system, y, time)
    if (g == 0).any():
        rates = guard_rates(system, y, time)
        system = with_modes(system, tuple(((g > 0) | ((g == 0) & (rates > 0))).astype(float)))
        system = _with_stop_at(system, y, time)
    return system


def _with_stop_at(system: System, y: Array, time: float) -> System:
    """Return a system whose stop is in the modes that belong to a state."""
    # The other elements are in the modes of the state already.
    if stop_of(system) is None:
        return system
    return with_contact(system, resting_side(system, np.array([_real(x) for x in y]), time))


def with_contact(system: System, side: int) -> System:
    """Return a system whose body rests on a side of its stop, 1 or -1; not at all if it is 0."""
    first = first_mode(system, stop_of(system))
    return with_changed(system, [first, first + 1], [side > 0, side < 0])


def guard_rates(system: System, y: Array, time: float = 0.0) -> Array:
    """Return the rates of the event functions along the motion.

    Args:
        system: The system.
        y: The state, of floats.
        time: The time, s.
    """
    along = np.append(system.rates(y, time), 1.0)
    at = np.append(y, time)
    rates: Array = derivative_along(lambda z: guards_at(system, z[:-1], z[-1]), at, along)
    return rates


def _real(number: Any) -> float:
    return float(getattr(number, "real", number))
