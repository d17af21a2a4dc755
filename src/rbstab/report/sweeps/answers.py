"""The answer of a sweep: how many members return, from which value on, and what is better?"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rbstab.experiment.answers.rounded import rounded_down
from rbstab.experiment.answers.run_answer import SETTLED as SETTLED_V
from rbstab.experiment.answers.run_answer import SETTLED_DRIVEN
from rbstab.experiment.answers.words import Sureness, words_with_meanings
from rbstab.files.counts import grouped
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Card, Cards, Statement
from rbstab.report.model.words import counted, number
from rbstab.report.sweeps.conditions.comparison import compared_quantities, ranking
from rbstab.report.sweeps.conditions.paired_conditions import PairedConditions, paired_conditions_of
from rbstab.report.sweeps.distributions import quantiles_of
from rbstab.report.sweeps.members import FAILED, LEFT_RANGE, Members
from rbstab.report.sweeps.proofs import tried_members
from rbstab.report.sweeps.quantities import peak_displacement, settling_time
from rbstab.report.sweeps.sketches import rest_sketch
from rbstab.sweep.proofs.bodies import named_members, ranges_of
from rbstab.sweep.proofs.columns import FALSE, NO_PROOF, PROVED
from rbstab.sweep.proofs.one_state import OneState

SYMBOLS = (
    (
        "at rest",
        f"{SETTLED_V} to the end of the run; where inputs supply power, {SETTLED_DRIVEN}",
    ),
    ("tilt", "the angle of the rotation between the attitude of the body and the desired one"),
    ("E1, E2, E3", "the displacement of the contact point from its anchor, by axis"),
    ("v", "the Lyapunov function, an energy: 0 at rest; v(0) is its value at the start"),
    ("θ2", "the second Euler angle; its range ends at ±π/2 rad, a right angle"),
)
"""The symbols on the card, and their meanings."""

ONE_STATE = "Has each body one rest state in the range?"
BETWEEN = "Has each body between the bounds of the plan one rest state?"

NEAR = 0.1
"""rad; a member that comes this close to the end of the range of θ2 is named."""


class SweepAnswer(NamedTuple):
    """What a reader wants to know first of a sweep.

    Attributes:
        sentences: How many members return, from which value of a parameter on, then which
            condition is better.
        card: The answers with a few numbers.
    """

    sentences: tuple[str, ...]
    card: Card


def answer_of(name: str, label: str, members: Members, command: str) -> SweepAnswer:
    """Return the answers about a sweep.

    Args:
        name: The anchor of the sweep.
        label: Its label.
        members: Its members.
        command: The command that makes proofs that are missing.
    """
    conditions = paired_conditions_of(members)
    card = Card(
        label,
        (
            *_outcomes(members),
            _rest(members, conditions, command),
            *_one_state(members),
            _range(members),
        ),
        _facts(members, pooled=conditions is None),
        target=name,
        sketch=rest_sketch(members, conditions),
    )
    better = ranking(members, compared_quantities(members))
    return SweepAnswer((*_sentences(members), *better), card)


def cards_of(name: str, cards: Sequence[Card]) -> Cards:
    """Return the cards of sweeps as a block with this name, with what their words mean."""
    return Cards(name, tuple(cards), (*words_with_meanings(), *SYMBOLS))


def _sentences(members: Members) -> list[str]:
    """Return how many members return, what is wanted, and which parameter decides."""
    found = members.found
    sentences = [f"{_capital(found.sentence)}. Desired: {found.aim}."]
    return sentences + ([f"{_capital(found.deciding)}."] if found.deciding else [])


def _outcomes(members: Members) -> list[Statement]:
    """Return how many members return, and from which value of a parameter on."""
    found = members.found
    sure = f"{grouped(found.proved)} of them proved" if found.proved else "seen, not proved"
    parts = (sure, "; ".join(found.parts[1:]), f"Desired: {found.aim}")
    sentence = ". ".join(_capital(part) for part in parts if part)
    tone = "good" if found.all_return else ""
    statements = [Statement("How many members return?", found.brief, sentence, tone)]
    if found.deciding:
        first, _, rest = found.deciding.partition("; ")
        statements.append(Statement("For which values?", _capital(first), _capital(rest)))
    return statements


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _rest(members: Members, conditions: PairedConditions | None, command: str) -> Statement:
    """Return whether the members come to rest."""
    question = "Do the members come to rest?"
    total, convergence = len(members), members.convergence
    proved, false = convergence == PROVED, convergence == FALSE
    parts = []
    if (convergence != NO_PROOF).any():
        parts.append(
            f"{grouped(np.count_nonzero(proved))} of {tried_members(convergence)} are proved to "
            f"converge to a rest state{_by_condition(proved, convergence != NO_PROOF, conditions)}"
        )
        untried = convergence == NO_PROOF
        uncovered = {why: int((own & untried).sum()) for why, own in members.undecidable.items()}
        parts += [
            f"{grouped(count)} have no proof: {why}" for why, count in uncovered.items() if count
        ]
    elif members.driven:
        parts.append("not proved: an input supplies power, so v may rise")
    else:
        parts.append(_never_tried(members, command))
    if false.any():
        parts.append(f"{grouped(np.count_nonzero(false))} are proved not to come to rest")
    others = ~proved & ~false
    if others.any():
        who = "others" if proved.any() or false.any() else "members"
        parts.append(_others(who, members, others))
    seen = int(np.count_nonzero(others & members.at_rest))
    word, tone = _word(total, int(proved.sum()), int(false.sum()), seen)
    return Statement(question, word, _capital("; ".join(parts)), tone)


def _one_state(members: Members) -> list[Statement]:
    """Return for how many bodies it is proved that they have one rest state.

    Nothing is said where it is decided of no body.
    """
    found = members.one_state
    if not found.bodies:
        return []
    tone = "bad" if found.word == str(Sureness.FALSE) else ""
    sentence, *refutations = found.sentences
    if found.proved:
        sentence += (
            ". Each motion of a proved body that stays in the range, and keeps a distance from its "
            "end in θ2, converges to its rest state"
            f"{_level(members, found)}"
        )
    statements = [Statement(ONE_STATE, found.word, sentence, tone)]
    if refutations:
        text = ". ".join(refutations)
        statements.append(Statement(BETWEEN, str(Sureness.FALSE), text, "bad"))
    return statements


def _level(members: Members, found: OneState) -> str:
    """Return below which v(0) motions of bodies that were proved among many converge."""
    # Of older sweeps, v may count from elsewhere.
    if not len(found.levels) or "rest_orientation" not in members.table:
        return ""
    least, most = rounded_down(min(found.levels)), rounded_down(max(found.levels))
    bound = f"{least} J" if least == most else f"{least} J (of some bodies up to {most} J)"
    every = len(found.levels) == found.proved
    whose = "So does each motion" if every else "Of those proved at once, so does each motion"
    return f". {whose} that starts in the range with v(0) below {bound}"


def _by_condition(proved: Array, tried: Array, conditions: PairedConditions | None) -> str:
    """Return how many members of each condition are proved, of those tried, in parentheses."""
    if conditions is None:
        return ""
    parts = []
    for k, label in enumerate(conditions.labels):
        own = conditions.codes == k
        count = np.count_nonzero(tried & own)
        found = (
            f"{grouped(np.count_nonzero(proved & own))} of {grouped(count)}"
            if count
            else "not tried"
        )
        parts.append(f"{label}: {found}")
    return f" ({'; '.join(parts)})"


def _never_tried(members: Members, command: str) -> str:
    """Return why nothing is proved of any member."""
    reasons = members.undecidable
    covered = np.zeros(len(members), dtype=bool)
    for own in reasons.values():
        covered |= own
    if covered.all() and reasons:
        return f"not proved: {'; '.join(reasons)}"
    every = counted(len(members), "member")
    return f"not proved: no proof was made for any of the {every} ({command} makes it)"


def _others(who: str, members: Members, chosen: Array) -> str:
    """Return how the computed runs of the members ended of which nothing is proved.

    Args:
        who: What they are called.
        members: All members.
        chosen: The mask of these, shape (n,).
    """
    count = int(np.count_nonzero(chosen))
    settled = int(np.count_nonzero(chosen & members.at_rest))
    early = int(np.count_nonzero(chosen & ~members.completed))
    some = f"of the {grouped(count)} {who},"
    end = "at rest by the end of their computed run"
    if settled == count:
        return f"{some} all were {end}"
    still = count - settled - early
    parts = [f"{grouped(settled) if settled else 'none'} {'was' if settled <= 1 else 'were'} {end}"]
    if settled:
        parts += [f"{grouped(still)} {'was' if still == 1 else 'were'} not"] if still else []
    parts += [f"{grouped(early)} ended early"] if early else []
    return f"{some} {', '.join(parts)}"


def _word(total: int, proved: int, false: int, seen: int) -> tuple[str, str]:
    if proved == total:
        # Green is only the outcome of a member that returns.
        return str(Sureness.PROVED), ""
    if false:
        return str(Sureness.FALSE), "bad"
    if proved:
        return f"{grouped(proved)} of {grouped(total)} {Sureness.PROVED}", ""
    if seen == total:
        return str(Sureness.SEEN), ""
    return (
        f"{grouped(seen)} of {grouped(total)} {Sureness.SEEN}"
        if seen
        else str(Sureness.NOT_DECIDED)
    ), ""


def _range(members: Members) -> Statement:
    """Return whether the computed motions stay in the range of the Euler angles."""
    question = "Do they stay in the range of θ2?"
    left = np.flatnonzero(members.outcomes == LEFT_RANGE)
    if len(left):
        named = named_members(ranges_of(left.tolist()))
        word = f"{grouped(len(left))} of {grouped(len(members))} left it"
        return Statement(question, word, f"As computed: {named}", "bad")
    failed = int(members.outcome_counts[FAILED])
    sentence = "No computed motion left it"
    if failed:
        sentence += f"; {counted(failed, 'run')} ended early"
    return Statement(question, str(Sureness.SEEN), sentence + _nearest(members))


def _nearest(members: Members) -> str:
    """Return which member came nearest to the end of the range; "" if none came near."""
    cosines = members.column("smallest_regularity")
    if not np.isfinite(cosines).any():
        return ""
    nearest = int(np.nanargmin(cosines))
    angle = float(np.arcsin(np.clip(cosines[nearest], 0.0, 1.0)))
    if angle >= NEAR:
        return ""
    return f"; member {nearest} came within {number(angle, 2)} rad of its end"


def _facts(members: Members, *, pooled: bool) -> tuple[tuple[str, str], ...]:
    """Return a few numbers of all members; quantities only if there are no conditions to pool."""
    facts = {"members": grouped(len(members)), "poses at rest": _poses(members)}
    settled, peak = settling_time(members), peak_displacement(members).values
    if pooled and np.isfinite(settled.values).any():
        (median,) = quantiles_of(settled.ranked, (0.5,))
        facts["at rest from (median of all)"] = (
            f"{number(median)} s" if math.isfinite(median) else "after the end"
        )
    if pooled and np.nanmax(peak, initial=0.0) > 0:
        facts["largest |E1|, |E2| or |E3|"] = f"{number(float(np.nanmax(peak)))} m"
    return tuple((name, value) for name, value in facts.items() if value != "0")


def _poses(members: Members) -> str:
    """Return at how many poses members rest; those of different bodies may differ by little."""
    found = members.found
    count = "very many" if found.poses is None else grouped(found.poses)
    return count if members.share_rest_states else f"{count} (the bodies differ)"
