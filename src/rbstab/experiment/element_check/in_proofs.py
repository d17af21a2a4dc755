"""Whether proofs of a held body can take an element of a user into account."""

from dataclasses import replace

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.analysis.proof.traced.separate import NotInProofsError, in_proofs, user_energies
from rbstab.elements.element import Element
from rbstab.systems.coordinates import ReducedCoordinates
from rbstab.systems.system import System

CONTACT_POINT = np.array([0.1, 0.2, 0.3])
"""m, body coordinates."""


def why_not_in_proofs(system: System, element: Element) -> str | None:
    """Return why no proof takes an element into account, or None if those of held bodies do.

    Args:
        system: A system in which the element acts.
        element: The element.
    """
    if element.supplies:
        return "it supplies power"
    if not in_proofs(element, held=True):
        return "it has switches or own states"
    # Away from the contact point, so that the centre moves.
    body = replace(system.body, contact_point=CONTACT_POINT)
    held = replace(system, body=body, elements=(element,), coordinates=ReducedCoordinates())
    try:
        user_energies(configurations(held))
    except NotInProofsError as error:
        return str(error).partition(": ")[2]
    return None
