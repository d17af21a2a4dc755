"""How long a body is searched for rest states with boxes of Θ."""

from dataclasses import dataclass

from rbstab.analysis.proof.ligaments.separate import ligaments_apart
from rbstab.analysis.proof.traced.separate import formula_count
from rbstab.systems.system import System

BOX_LIMIT = 400_000
"""The number of boxes at which a search stops that is asked for."""

BRIEF_BOX_LIMIT = 60_000
"""The number of boxes at which a brief search stops: 15,000 a second with springs, and up to
100,000 without. Bodies of the paper need some 1,000."""

BRIEF_LIGAMENT_BOX_LIMIT = 20_000
"""The same for one ligament of a body that is not held: some ten seconds."""

BRIEF_FORMULA_BOX_LIMIT = 12_000
"""The same for one formula of a user: some five seconds."""


@dataclass(frozen=True)
class Limit:
    """The end of a search.

    Attributes:
        boxes: The number of boxes at which it stops.
        slow: Whether each box takes long, so that little is left to do when it has stopped.
    """

    boxes: int
    slow: bool


def search_limit(system: System, *, brief: bool) -> Limit:
    """Return when a search stops.

    Boxes of a body that is not held take longer with each ligament, and others with each formula
    of a user that is no polynomial.

    Args:
        system: The system.
        brief: Whether it may take some five seconds at most.
    """
    formulas = formula_count(system)
    if formulas:
        return Limit((BRIEF_FORMULA_BOX_LIMIT if brief else BOX_LIMIT) // formulas, slow=True)
    ligaments = len(ligaments_apart(system)[1])
    if ligaments == 0 or system.coordinates.holds_contact:
        return Limit(BRIEF_BOX_LIMIT if brief else BOX_LIMIT, slow=False)
    return Limit((BRIEF_LIGAMENT_BOX_LIMIT if brief else BOX_LIMIT) // ligaments, slow=True)
