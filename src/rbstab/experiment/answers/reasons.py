"""Reasons in stored proofs and results: those of older files are read in today's words."""

from typing import Annotated

from pydantic import AfterValidator

NOT_DAMPED = "it could not be shown that every motion loses energy"
"""Why nothing is proved of a body that may move without losing energy; `why_not_damped` follows."""

IN_0_2_0RC1 = "some motions may lose no energy, because no damper acts on them"
"""The same in files of version 0.2.0rc1."""


def in_new_words(text: str) -> str:
    """Return a stored reason, or a sentence with one, in the words of this version."""
    return text.replace(IN_0_2_0RC1, NOT_DAMPED)


Reason = Annotated[str, AfterValidator(in_new_words)]
"""A reason in a file."""
