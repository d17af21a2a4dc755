"""Reasons in stored proofs and results: those of older files are read in today's words."""

from collections.abc import Sequence
from typing import Annotated

from pydantic import AfterValidator

UNDECIDED = "in some small parts of the range it could not be decided whether there is a rest state"
"""The outcome of a search with boxes left: `SearchOutcome.UNDECIDED`, without its slow import."""

NOT_DAMPED = "some motions may lose no energy, because no damper acts on them"
"""Why nothing is proved of a body that may move without losing energy."""


def not_damped(by: Sequence[str]) -> str:
    """Return the same reason with what it comes from, such as "L_r is 0"."""
    return f"{NOT_DAMPED}: {' and '.join(by)}" if by else NOT_DAMPED


_NEW_WORDS = {
    "some boxes could be neither emptied nor shown to hold one zero": UNDECIDED,
    "no elements damp every motion": NOT_DAMPED,
}
"""The reasons that older files have in other words."""


def in_new_words(text: str) -> str:
    """Return a stored reason, or a sentence with one, in the words of this version."""
    for old, new in _NEW_WORDS.items():
        text = text.replace(old, new)
    return text


Reason = Annotated[str, AfterValidator(in_new_words)]
"""A reason in a file."""
