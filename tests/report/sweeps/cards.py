"""The answers about a made up sweep."""

from rbstab.report.sweeps.answers import answer_of

REST, RANGE = "Do the members come to rest?", "Do they stay in the range of θ2?"


def card_of(members):
    """Return the sentences that compare conditions, and the card."""
    answer = answer_of("sweep-1", "made", members, "rbstab sweep PLAN --prove")
    first = 2 if members.found.deciding else 1
    return list(answer.sentences[first:]), answer.card


def answered(card, question):
    """Return the statement of a card that answers a question."""
    (found,) = (one for one in card.statements if one.question == question)
    return found
