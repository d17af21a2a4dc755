"""The answer of a sweep: do its members come to rest, and which condition is better?"""

import numpy as np

from rbstab.experiment.answers.words import Sureness, words_with_meanings
from rbstab.report.model.document import Block, Card, Cards, Statement
from rbstab.report.model.words import counted, number
from rbstab.report.sweeps.conditions.comparison import compared_quantities, ranking
from rbstab.report.sweeps.conditions.paired_conditions import paired_conditions_of
from rbstab.report.sweeps.members import OUTCOMES, SETTLED, UNSETTLED, Members
from rbstab.report.sweeps.quantities import peak_displacement, settling_time
from rbstab.report.sweeps.sketches import rest_sketch
from rbstab.sweep.proofs.columns import FALSE, NO_PROOF, PROVED

SYMBOLS = (
    ("E1, E2, E3", "the displacement of the contact point from its anchor, by axis"),
    ("θ2", "the second Euler angle; its range ends at ±π/2 rad, a right angle"),
)
"""The symbols on the card, and their meanings."""


def answer_blocks(name: str, label: str, members: Members) -> list[Block]:
    """Return a sentence on each comparison of conditions, and the card of a sweep.

    Args:
        name: The anchor of the sweep.
        label: Its label.
        members: Its members.
    """
    card = Card(
        label,
        (_rest(members), _range(members)),
        _facts(members),
        target=f"{name}-members",
        sketch=rest_sketch(members, paired_conditions_of(members)),
    )
    cards = Cards(f"{name}-answer", (card,), (*words_with_meanings(), *SYMBOLS))
    return [*ranking(members, compared_quantities(members)), cards]


def _rest(members: Members) -> Statement:
    """Return whether the members come to rest."""
    question = "Do the members come to rest?"
    total, convergence = len(members), members.convergence
    proved, false = (int(np.count_nonzero(convergence == code)) for code in (PROVED, FALSE))
    settled = members.outcomes == OUTCOMES.index(SETTLED)
    undecided = (convergence != PROVED) & (convergence != FALSE)
    seen = int(np.count_nonzero(settled & undecided))
    parts = []
    if proved or (convergence != NO_PROOF).any():
        parts.append(f"{proved} of {total} are proved to converge to a rest state")
    elif members.driven:
        parts.append("not proved: an input supplies power, so v may rise")
    else:
        parts.append(f"not proved: no proof was made for any of the {counted(total, 'member')}")
    if false:
        parts.append(f"{false} are proved not to come to rest")
    others = total - proved - false
    if others:
        untried = int(np.count_nonzero(convergence == NO_PROOF))
        who = "others" if proved or false else "members"
        parts.append(_others(who, others, seen, untried if untried < total else 0))
    sentence = "; ".join(parts)
    word, tone = _word(total, proved, false, seen)
    return Statement(question, word, sentence[:1].upper() + sentence[1:], tone)


def _others(who: str, count: int, seen: int, untried: int) -> str:
    """Return how the computed runs of the members ended of which nothing is proved.

    Args:
        who: What they are called.
        count: Their number.
        seen: How many were at rest by the end.
        untried: For how many of them no proof was made, if any was made.
    """
    some_of = "all" if untried == count else untried
    without = f", {some_of} of them without a proof" if untried else ""
    some = f"of the {count} {who}{without},"
    end = "at rest by the end of their computed run"
    if seen == count:
        return f"{some} all were {end}"
    if seen:
        return f"{some} {seen} were {end}; {count - seen} were not, or their run ended early"
    return f"{some} none was {end}"


def _word(total: int, proved: int, false: int, seen: int) -> tuple[str, str]:
    if proved == total:
        return str(Sureness.PROVED), "good"
    if false:
        return str(Sureness.FALSE), "bad"
    if proved:
        return f"{proved} of {total} {Sureness.PROVED}", ""
    if seen == total:
        return str(Sureness.SEEN), ""
    return (f"{seen} of {total} {Sureness.SEEN}" if seen else str(Sureness.NOT_DECIDED)), ""


def _range(members: Members) -> Statement:
    """Return whether the computed motions stay in the range of the Euler angles."""
    left = int(members.outcome_counts[OUTCOMES.index("range left")])
    sentence = "No computed motion left it" if not left else f"{left} of {len(members)} left it"
    question = "Do they stay in the range of θ2?"
    if left:
        return Statement(question, str(Sureness.FALSE), f"{sentence}, as computed", "bad")
    failed = sum(members.outcome_counts.tolist()[2:])
    if failed:
        sentence += f"; {counted(failed, 'run')} ended early"
    return Statement(question, str(Sureness.SEEN), sentence)


def _facts(members: Members) -> tuple[tuple[str, str], ...]:
    counts = members.outcome_counts.tolist()
    facts = {
        "members": str(len(members)),
        "at rest by the end": str(counts[OUTCOMES.index(SETTLED)]),
        "not at rest by the end": str(counts[OUTCOMES.index(UNSETTLED)]),
    }
    facts |= {status: str(n) for status, n in zip(OUTCOMES[2:], counts[2:], strict=True) if n}
    settled, peak = settling_time(members).values, peak_displacement(members).values
    if np.isfinite(settled).any():
        facts["at rest from (median)"] = f"{number(float(np.nanmedian(settled)))} s"
    if np.isfinite(peak).any():
        facts["largest |E1|, |E2| or |E3|"] = f"{number(float(np.nanmax(peak)))} m"
    return tuple((name, value) for name, value in facts.items() if value != "0")
