"""The sliding connector of a system, by its own sides or by modes."""

from dataclasses import replace

import numpy as np

from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.sliding_ties import AtContact
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
