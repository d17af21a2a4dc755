"""What maps, curves and effects show of the members: words and quantities, the deciding ones first.

A word, such as the outcome, is shown as it is of single members, and as a share of several.
"""

import numpy as np

from rbstab.report.model.figure import Axis
from rbstab.report.model.palette import OPEN, UNTRIED
from rbstab.report.sweeps.basins import basins_of
from rbstab.report.sweeps.members import RETURNS, Members
from rbstab.report.sweeps.proofs import proof_words
from rbstab.report.sweeps.quantities import (
    MemberQuantity,
    final_tilt,
    main_quantities,
    outcome_words,
    start_over_level,
)

WORDS = ("outcome", "proofs", "basins")
"""The names of words."""

FIRST = (*WORDS, "final-tilt")
"""The names of what is shown first: what became of the members, and how far they lean."""


def shown_of(members: Members) -> list[MemberQuantity]:
    """Return what differs among the members: words first, then quantities."""
    # Those that return lean by less than is wanted of them.
    tilts = [final_tilt(members)] if members.outcome_counts[RETURNS] < len(members) else []
    over_level = start_over_level(members)
    quantities = [*tilts, *main_quantities(members), *([] if over_level is None else [over_level])]
    return [*_words(members), *(quantity for quantity in quantities if quantity.varies)]


def first_of(shown: list[MemberQuantity]) -> int:
    """Return how many of those come first: what became of the members, but two panels at least."""
    return max(2, sum(quantity.name in FIRST for quantity in shown))


def point_colour(word: MemberQuantity, code: int) -> int:
    """Return the number of the colour of single points: pale grey would not show."""
    colour = (word.axis.colours or range(len(word.axis.categories)))[code]
    return OPEN if colour == UNTRIED else colour


def _words(members: Members) -> list[MemberQuantity]:
    words = [outcome_words(members), proof_words(members)]
    basins = basins_of(members)
    if basins is not None:
        codes = np.where(basins.codes < 0, np.nan, basins.codes)
        labels = tuple(f"rest state {k + 1}" for k in range(len(basins.energies)))
        axis = Axis("approaches", categories=labels)
        share = "share that approaches rest state 1", (basins.codes == 0).astype(float)
        words.append(MemberQuantity("basins", axis, codes, "no rest state was found", share=share))
    return [word for word in words if len(word.axis.categories) > 1]
