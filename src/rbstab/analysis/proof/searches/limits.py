"""How long a body with ligaments or elements of users is searched for rest states."""

from rbstab.analysis.proof.branch_and_bound import BOX_LIMIT
from rbstab.analysis.proof.ligaments.separate import ligaments_apart
from rbstab.analysis.proof.traced.separate import formula_count
from rbstab.systems.system import System

BRIEF_BOX_LIMIT = 30_000
"""The number of boxes at which a brief search stops, for one ligament: some three seconds."""

BRIEF_FORMULA_BOX_LIMIT = 12_000
"""The same for one formula of a user: some five seconds."""


def box_limit(system: System, *, brief: bool) -> int:
    """Return the number of boxes at which a search stops.

    Boxes of a body that is not held take longer with each ligament, and others with each formula
    of a user that is no polynomial.

    Args:
        system: The system.
        brief: Whether it may take some five seconds at most.
    """
    formulas = formula_count(system)
    if formulas:
        return (BRIEF_FORMULA_BOX_LIMIT if brief else BOX_LIMIT) // formulas
    count = len(ligaments_apart(system)[1])
    if count == 0 or system.coordinates.holds_contact:
        return BOX_LIMIT
    return (BRIEF_BOX_LIMIT if brief else BOX_LIMIT) // count
