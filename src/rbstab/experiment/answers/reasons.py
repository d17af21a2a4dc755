"""Reasons that several kinds of proofs give."""

NOT_DAMPED = "it could not be shown that every motion loses energy"
"""Why nothing is proved of a body that may move without losing energy; `why_not_damped` follows."""
