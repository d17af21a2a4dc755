"""The first screen of runs: the outcome in a sentence, and a card for each run."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence

from rbstab.experiment.answers.outcome import KINDS
from rbstab.experiment.answers.run_answer import Answer
from rbstab.experiment.answers.wanted import wanted
from rbstab.experiment.answers.words import Sureness, meanings, words_with_meanings
from rbstab.experiment.convergence.convergence import EVERY_START
from rbstab.integrate.status import RunStatus
from rbstab.report.model.document import Block, Card, Cards, Sketch, Statement
from rbstab.report.model.words import NO_VALUE, counted, listed, number
from rbstab.report.runs.facts import FACTS, RunFacts
from rbstab.report.runs.sketches import decay_sketches
from rbstab.report.runs.tables import ANSWER_TONES, outcome_tone

MAX_CARDS = 12
"""If there are more runs, their answers stand in the table of runs only."""

QUESTIONS = {
    "this_start": "From this start: does it come to rest?",
    "whole_range": "From the whole range: where does it come to rest?",
    "pushes": "Which pushes does it survive?",
}
"""What a run is asked after its outcome; the names are those of `RunAnswer.answers`."""

WHOLE_RANGE = (
    "whole range",
    "all motions that stay in the range of the Euler angles, and keep a distance from θ2 = ±π/2; "
    "where the energy depends on no Euler angles, all motions",
)
"""The word in the sentence and on cards, and what it means."""

NUMBERS = ("at rest from", "peak |E|")
"""The numbers on the card of each run."""

MORE_NUMBERS = ("peak |θ2|", "v(0)", "largest v", "start above the rest state of c*", "v(0)/c*")
"""More numbers on the card of a single run, where it has them."""


def answer_blocks(facts: Sequence[RunFacts]) -> tuple[Block, ...]:
    """Return the sentence, the cards, and what the words mean."""
    sentences = answer_sentence(facts), *_first_at_rest(facts)
    if len(facts) > MAX_CARDS:
        return (*sentences, meanings())
    sketches = decay_sketches([entry.run for entry in facts])
    if len(facts) == 1:
        cards = [_whole_card(facts[0], sketches[0])]
    else:
        cards = _cards_of_several(facts, sketches)
    names = {name for card in cards for name, _ in card.facts}
    words = [(f.name, f.words) for f in FACTS.values() if f.name in names and f.words]
    if len(facts) > 1:
        words.append(WHOLE_RANGE)
    return (*sentences, Cards("answers", tuple(cards), (*words_with_meanings(), *words)))


def answer_sentence(facts: Sequence[RunFacts]) -> str:
    """Return a sentence with the outcomes of all runs, and the answers of several."""
    if len(facts) == 1:
        return f"{_capital(facts[0].answer.outcome.sentence)}."
    kinds = Counter(entry.answer.outcome.kind for entry in facts)
    outcomes = "; ".join(f"{kind.words}: {kinds[kind]}" for kind in KINDS if kinds[kind])
    kept = sum(entry.answer.whole_range.sentence == EVERY_START for entry in facts)
    proved = f"; of {kept}, it is also proved that all motions stay in it" if kept else ""
    return (
        f"{counted(len(facts), 'run')}. {_capital(outcomes)}.{_common_desire(facts)} "
        f"This start: {_counts(entry.answer.this_start for entry in facts)}. "
        f"Whole range: {_counts(entry.answer.whole_range for entry in facts)}{proved}."
    )


def _counts(answers: Iterable[Answer]) -> str:
    """Return how many answers have each word, the surest first."""
    counts = Counter((list(Sureness).index(one.sureness), one.word) for one in answers)
    return "; ".join(f"{word} ({count})" for (_, word), count in sorted(counts.items()))


def _first_at_rest(facts: Sequence[RunFacts]) -> tuple[str, ...]:
    """Return a sentence that names the run that comes to rest first, of several of one body."""
    bodies = [entry.run.data.get("body") for entry in facts]
    times = {entry.run.label: entry.run.settling_time for entry in facts}
    settled = sorted((time, label) for label, time in times.items() if not math.isnan(time))
    if len(settled) < 2 or any(body != bodies[0] for body in bodies):
        return ()
    ends = settled[0], settled[-1]
    first, last = (f"{label}, from {number(time)} s on" for time, label in ends)
    others = [label for label, time in times.items() if math.isnan(time)]
    without = f"; not by the end: {listed(others)}" if others else ""
    # Runs that are alike have no first one.
    is_race = number(ends[0][0]) != number(ends[1][0])
    return (f"At rest first: {first}; last: {last}{without}.",) if is_race else ()


def _whole_card(facts: RunFacts, sketch: Sketch | None) -> Card:
    """Return the card of a single run, with all answers in sentences."""
    answers = [
        Statement(
            QUESTIONS[name],
            answer.word,
            _capital(answer.sentence),
            ANSWER_TONES.get(answer.sureness, ""),
        )
        for name, answer in facts.answer.answers.items()
    ]
    more = [(name, FACTS[name].shown(facts)) for name in MORE_NUMBERS]
    return _of(facts, answers, [*_numbers(facts), *more], sketch)


def _cards_of_several(facts: Sequence[RunFacts], sketches: Sequence[Sketch | None]) -> list[Card]:
    """Return the cards of several runs: what is the same of all, the sentence says.

    The table of answers has their sentences.
    """
    varying = [
        name
        for name in ("this_start", "whole_range")
        if len({entry.answer.answers[name].word for entry in facts}) > 1
    ]
    desired = not _common_desire(facts)
    cards = []
    for entry, sketch in zip(facts, sketches, strict=True):
        answers = entry.answer.answers
        words = [(name.replace("_", " "), answers[name].word) for name in varying]
        cards.append(_of(entry, [], [*_numbers(entry), *words], sketch, desired=desired))
    return cards


def _common_desire(facts: Sequence[RunFacts]) -> str:
    """Return the desired attitude of all runs as a sentence; "" if they differ."""
    wishes = {str(wanted(entry.run.config)) for entry in facts}
    return f" Desired: {wishes.pop()}." if len(wishes) == 1 else ""


def _numbers(facts: RunFacts) -> list[tuple[str, str]]:
    return [(name, FACTS[name].shown(facts) or NO_VALUE) for name in NUMBERS]


def _of(
    facts: RunFacts,
    answers: Sequence[Statement],
    numbers: Sequence[tuple[str, str]],
    sketch: Sketch | None,
    *,
    desired: bool = True,
) -> Card:
    """Return a card that begins with the outcome, and with what is wrong."""
    status, end = facts.run.result.status, number(facts.run.summary.end_time)
    return Card(
        facts.run.label,
        (_outcome(facts, desired=desired), *answers),
        tuple((name, text) for name, text in numbers if text),
        target="certificates",
        sketch=sketch,
        alarm="" if status == RunStatus.COMPLETED else f"ended early: {status} at {end} s",
    )


def _outcome(facts: RunFacts, *, desired: bool) -> Statement:
    """Return where the body rests, how far from where it should, and how surely."""
    outcome = facts.answer.outcome
    where = outcome.sentence.partition(outcome.kind.words)[2].removesuffix(f": {outcome.sureness}")
    wish = f"Desired: {wanted(facts.run.config)}" if desired else ""
    sentences = (_capital(where.removeprefix(":").strip()), wish)
    word = f"{_capital(outcome.brief)}: {outcome.sureness}"
    sentence = ". ".join(filter(None, sentences))
    return Statement("Where does it rest?", word, sentence, outcome_tone(outcome))


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
