"""The modes of the axes of a sliding connector in implicit steps, and the system in them."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.systems.connector import connector_of, with_connector
from rbstab.systems.coordinates import ContactCoordinates, PartlyHeldCoordinates
from rbstab.systems.system import System


class Modes(NamedTuple):
    """The mode of each axis, as two tuples of three numbers.

    mode is the side of the surface, -1 or 1. It is 0 for an axis that is held on the surface
    (held = 1).
    """

    mode: tuple[float, float, float]
    held: tuple[float, float, float] = (0.0, 0.0, 0.0)


def system_for_modes(system: System, modes: Modes) -> System:
    """Return the smooth system for these modes, in coordinates W."""
    connector = connector_of(system)
    changed = replace(connector, mode=np.array(modes.mode), layer=np.zeros(3))
    coordinates = ContactCoordinates()
    if any(modes.held):
        held = np.array(modes.held)
        coordinates = PartlyHeldCoordinates(held, connector.rate_weight * connector.slope)
    return replace(with_connector(system, changed), coordinates=coordinates)


def initial_modes(system: System, y: Array) -> Modes:
    """Return the initial modes, with no axis held.

    An axis exactly on the surface has the side that it enters next.
    """
    motion = system.motion(y)
    s = connector_of(system).surface(motion.E, motion.F)
    entered = np.where(s != 0, s, motion.F)
    a, b, c = np.where(entered >= 0, 1.0, -1.0).tolist()
    return Modes((a, b, c))
