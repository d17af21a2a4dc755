"""The sliding connector of a system (eq. 39), and the law by which it is followed."""

from dataclasses import replace

import numpy as np

from rbstab.elements.sliding import (
    Crossing,
    Filippov,
    Layered,
    Sliding,
    SlidingConnector,
    SlidingTie,
    Sticking,
)
from rbstab.mechanics.numbers import Array
from rbstab.systems.filippov import START_TOLERANCE
from rbstab.systems.impact import stop_of
from rbstab.systems.system import System


def is_connector(element: object) -> bool:
    """Return whether an element is the sliding connector of a controller, of any law."""
    return isinstance(element, Sliding) and not isinstance(element, SlidingTie)


def connector_of(system: System) -> Sliding:
    """Return the sliding connector of a system; it must have one."""
    return next(element for element in system.elements if is_connector(element))  # type: ignore[return-value]


def with_connector(system: System, changed: Sliding) -> System:
    """Return a system with another sliding connector in the place of its own."""
    elements = tuple(changed if is_connector(element) else element for element in system.elements)
    return replace(system, elements=elements)


def with_law(system: System, law: type[Sliding], **fields: Array) -> System:
    """Return a system whose sliding connector has another law, with the modes in `fields`."""
    now = connector_of(system)
    names = "K_s", "rate_weight", "slope", "layer_width"
    return with_connector(system, law(**{name: getattr(now, name) for name in names} | fields))


def inside_layers(system: System) -> System:
    """Return a system whose connector is inside its boundary layer on each axis."""
    return with_law(system, SlidingConnector, layer=np.ones(3))


def by_modes(system: System, start: Array, *, layered: bool, sticks: bool) -> System:
    """Return a system whose sliding connector has modes 0 and 1.

    Args:
        system: The system.
        start: The state at the start: an axis that begins at rest on s = E may be held.
        layered: Whether a boundary layer replaces the sign.
        sticks: Whether chattering axes may stick.
    """
    law: type[Sliding] = Crossing
    if layered:
        law = Layered
    elif connector_of(system).rate_weight:
        law = Filippov
    elif sticks or _begins_at_rest(system, start):
        law = Sticking
    return with_law(system, law)


def _begins_at_rest(system: System, start: Array) -> bool:
    """Return whether an axis of the contact point begins at E = F = 0, and so may be held."""
    # No axis is held on s = E beside a stop: each impact would throw it off, to bounce again.
    if stop_of(system) is not None:
        return False
    motion = system.motion(start)
    at_rest = np.maximum(np.abs(motion.E), np.abs(motion.F)) <= START_TOLERANCE
    return bool(at_rest.any())
