"""How a search for all rest states ended."""

from enum import Enum


class SearchOutcome(Enum):
    """How a search for all zeros ended; the value is the text to show."""

    PROVED = "every zero in the range is known"
    UNDECIDED = (
        "in some small parts of the range it could not be decided whether there is a rest state"
    )
    BOX_LIMIT = "the limit on the number of boxes was reached"
    FAMILY = "a continuum (a family) of rest states is suspected, which is not counted"
    SEARCHED = "looked for, not proved"
