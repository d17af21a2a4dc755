"""How many boxes of Θ are searched for rest states."""

from dataclasses import dataclass

from rbstab.proof.exact.atoms import COS, OF, SIN, STEP, VAR
from rbstab.proof.exact.lengths import springs_of
from rbstab.proof.model import Energy

MOST, BRIEF = 400_000, 60_000
"""Boxes of a search that is asked for, and of one that is not: these take some five seconds."""

MOST_WITH_SPRINGS, BRIEF_WITH_SPRINGS = 100_000, 4_000
"""The same for springs of a body that is not held."""

BRIEF_WITH_LIGAMENTS = 20_000
"""The same for one ligament of a body that is not held: some ten seconds."""

TERMS = 40
"""So many terms of an energy of X take as long as all else."""

BRIEF_WITH_FUNCTIONS, FEWEST = 48_000, 12_000
"""The same with one function of several angles, such as a length; with many of them."""


TELLING = 8_000
"""The boxes after which the rate of a search is known; of several ligaments a brief one tells."""


@dataclass(frozen=True)
class Limit:
    """The end of a search.

    Attributes:
        boxes: The number of boxes at which it stops.
        most: The same of a search that is asked for.
        slow: Whether each box takes long, so that little is left to do when it has stopped.
        telling: The number of boxes after which it is known whether `most` can be enough.
    """

    boxes: int
    most: int
    slow: bool
    telling: int


def search_limit(energy: Energy, *, brief: bool) -> Limit:
    """Return when a search stops.

    Args:
        energy: The energy.
        brief: Whether nobody asked for the proof.
    """
    telling = TELLING
    if energy.free and springs_of(energy.U, energy.free).lines:
        most, less = MOST_WITH_SPRINGS, BRIEF_WITH_SPRINGS
    elif energy.free:
        # With more of them boxes take longer, and more are needed.
        ligaments = max(1, sum(a.kind == OF for a in energy.U.atoms))
        longer = 1 + len(energy.U.terms) // TERMS
        most = MOST // (ligaments * longer)
        less = BRIEF_WITH_LIGAMENTS // (ligaments**2 * longer)
        telling = min(TELLING, less)
    else:
        count = sum(
            a.kind not in {VAR, STEP} and (len(a.variables) > 1 or a.kind not in {SIN, COS})
            for a in energy.U.all_atoms
        )
        most, less = MOST, max(FEWEST, BRIEF_WITH_FUNCTIONS // count) if count else BRIEF
    slow = bool(energy.free) or less < BRIEF
    return Limit(less if brief else most, most, slow, telling)
