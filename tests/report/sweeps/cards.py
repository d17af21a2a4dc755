"""The answers about a made up sweep."""

from rbstab.report.sweeps.answers import answer_of


def card_of(members):
    """Return the sentences that compare conditions, and the card."""
    (_, *sentences), card = answer_of("sweep-1", "made", members, "rbstab sweep PLAN --prove")
    return sentences, card
