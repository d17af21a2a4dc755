"""Whether proofs can take an element of a user into account."""

from dataclasses import replace

import numpy as np

from rbstab.elements.element import Element
from rbstab.proof.passive.passive import in_proofs, why_not_in_proofs
from rbstab.systems.coordinates import CentreCoordinates, Coordinates, ReducedCoordinates
from rbstab.systems.system import System

CONTACT_POINT = np.array([0.1, 0.2, 0.3])
"""m, body coordinates."""


def in_which_proofs(system: System, element: Element) -> str:
    """Return whether proofs take an element into account, as a sentence.

    Args:
        system: A system in which the element acts.
        element: The element.
    """
    why = _why_never(element) or _why_not(system, element, ReducedCoordinates())
    if why is not None:
        return f"no proof takes it into account: {why}"
    why = _why_not(system, element, CentreCoordinates())
    if why is not None:
        return f"proofs of a held body take it into account, those of other bodies do not: {why}"
    return "proofs take it into account"


def _why_never(element: Element) -> str | None:
    if element.supplies:
        return "it supplies power"
    return None if in_proofs(element) else "it has own states beside switches, or too many switches"


def _why_not(system: System, element: Element, coordinates: Coordinates) -> str | None:
    """Return why no proof takes an element into account in some coordinates."""
    # Away from the contact point, so that the centre moves.
    body = replace(system.body, contact_point=CONTACT_POINT)
    alone = replace(system, body=body, elements=(element,), coordinates=coordinates)
    why = why_not_in_proofs(alone)
    return None if why is None else why.partition(": ")[2]
