"""The words for how sure a statement is. All that people read about stability uses them."""

from enum import StrEnum

from rbstab.analysis.certificate.verdict import Verdict
from rbstab.store.result import WORDS_OF_VERDICTS


class Sureness(StrEnum):
    """How sure a statement is."""

    PROVED = "proved"
    """A theorem whose hypotheses were checked in rigorous arithmetic, for the exact motion."""

    SEEN = "seen"
    """It held along the computed run, within its stated errors. It is not proved."""

    FALSE = "false"
    """It does not hold; a counterexample is named."""

    NOT_DECIDED = "not decided"
    """Neither; the reason is given, and what would decide."""


MEANINGS = {
    Sureness.PROVED: "a theorem, checked in rigorous arithmetic, for the exact motion",
    Sureness.SEEN: "held along the computed run, within its errors; not proved",
    Sureness.FALSE: "does not hold; a counterexample is named",
    Sureness.NOT_DECIDED: "neither; the reason is given",
}
"""What each word means, to be printed where the words first stand."""


def words_with_meanings() -> tuple[tuple[str, str], ...]:
    """Return the words, each with its meaning."""
    return tuple((str(word), meaning) for word, meaning in MEANINGS.items())


def meanings() -> str:
    """Return a sentence that says what the words mean."""
    words = "; ".join(f"{word}: {meaning}" for word, meaning in MEANINGS.items())
    return f"{words[:1].upper()}{words[1:]}."


def word_of(verdict: str) -> str:
    """Return the word for a stored verdict; an unknown verdict is returned as it is."""
    return WORDS_OF_VERDICTS.get(verdict, verdict)


def run_words(verdict: str) -> str:
    """Return the word for the verdict of a computed run, with what it means if inputs act."""
    if verdict != Verdict.DRIVEN:
        return word_of(verdict)
    return (
        f"{word_of(verdict)}: elements supply power, so v need not decrease; what rises is supplied"
    )
