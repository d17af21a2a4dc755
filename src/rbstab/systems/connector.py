"""The sliding connector of a system: eq. 39 with its own sides, or by modes."""

from dataclasses import replace

import numpy as np

from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.sliding_ties import (
    AtContact,
    CrossingConnector,
    FilippovConnector,
    LayeredConnector,
    StickingConnector,
)
from rbstab.mechanics.numbers import Array
from rbstab.systems.filippov import START_TOLERANCE
from rbstab.systems.impact import stop_of
from rbstab.systems.system import System


def connector_of(system: System) -> SlidingConnector:
    """Return the sliding connector of a system, as eq. 39 with the sides of its modes.

    Raises:
        ValueError: The system has no sliding connector.
    """
    for element in system.elements:
        if isinstance(element, SlidingConnector):
            return element
        if isinstance(element, AtContact):
            return element.connector
    raise ValueError("the system has no sliding connector")


def with_connector(system: System, changed: SlidingConnector | AtContact) -> System:
    """Return a system with another sliding connector in the place of its own."""
    kinds = SlidingConnector, AtContact
    elements = tuple(changed if isinstance(e, kinds) else e for e in system.elements)
    return replace(system, elements=elements)


def inside_layers(system: System) -> System:
    """Return a system whose connector is inside its boundary layer on each axis."""
    connector = connector_of(system)
    return with_connector(system, replace(connector, mode=np.zeros(3), layer=np.ones(3)))


def by_modes(system: System, start: Array, *, layered: bool, sticks: bool) -> System:
    """Return a system whose sliding connector has modes 0 and 1.

    Args:
        system: The system.
        start: The state at the start: an axis that begins at rest on s = E may be held.
        layered: Whether a boundary layer replaces the sign.
        sticks: Whether chattering axes may stick.
    """
    connector = connector_of(system)
    kind: type[AtContact] = CrossingConnector
    if layered:
        kind = LayeredConnector
    elif connector.rate_weight:
        kind = FilippovConnector
    elif sticks or _begins_at_rest(system, start):
        kind = StickingConnector
    names = "K_s", "rate_weight", "slope", "layer_width"
    return with_connector(system, kind(**{name: getattr(connector, name) for name in names}))


def _begins_at_rest(system: System, start: Array) -> bool:
    """Return whether an axis of the contact point begins at E = F = 0, and so may be held.

    No axis is held on s = E beside a stop: each impact would throw it off, to bounce again.
    """
    if stop_of(system) is not None:
        return False
    motion = system.motion(start)
    at_rest = np.maximum(np.abs(motion.E), np.abs(motion.F)) <= START_TOLERANCE
    return bool(at_rest.any())
