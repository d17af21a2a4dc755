"""The first screen of runs: the outcome in a sentence, and a card for each run."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence

from rbstab.experiment.answers.facts import FACTS, answer_tone, ended_early, outcome_tone
from rbstab.experiment.answers.outcome import KINDS
from rbstab.experiment.answers.rounded import NO_VALUE, number
from rbstab.experiment.answers.run_answer import Answer
from rbstab.experiment.answers.wanted import wanted
from rbstab.experiment.answers.words import Sureness, meanings, words_with_meanings
from rbstab.experiment.convergence.convergence import EVERY_START
from rbstab.report.model.document import Block, Card, Cards, Sketch, Statement
from rbstab.report.model.words import counted, listed
from rbstab.report.reading.sources import Run
from rbstab.report.runs.sketches import decay_sketches

MAX_CARDS = 12
"""If there are more runs, their answers stand in the table of runs only."""

QUESTIONS = {
    "this_start": "From this start: does it come to rest?",
    "whole_range": "From the whole range: where does it come to rest?",
    "pushes": "Which pushes does it survive?",
    "bound": "Which disturbances never tilt it far?",
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


def answer_blocks(runs: Sequence[Run]) -> tuple[Block, ...]:
    """Return the sentence, the cards, and what the words mean."""
    sentences = answer_sentence(runs), *_first_at_rest(runs)
    if len(runs) > MAX_CARDS:
        return (*sentences, meanings())
    # What is the same of all runs, the sentence says.
    varying = [
        name
        for name in ("this_start", "whole_range")
        if len({run.answer.answers[name].word for run in runs}) > 1
    ]
    has_desire = len(runs) == 1 or not _common_desire(runs)
    cards = tuple(
        _card(run, sketch, varying, is_alone=len(runs) == 1, has_desire=has_desire)
        for run, sketch in zip(runs, decay_sketches(runs), strict=True)
    )
    names = {name for card in cards for name, _ in card.facts}
    words = [
        (fact.name, fact.words) for fact in FACTS.values() if fact.name in names and fact.words
    ]
    if len(runs) > 1:
        words.append(WHOLE_RANGE)
    return (*sentences, Cards("answers", cards, (*words_with_meanings(), *words)))


def answer_sentence(runs: Sequence[Run]) -> str:
    """Return a sentence with the outcomes of all runs, and the answers of several."""
    if len(runs) == 1:
        return f"{_capital(runs[0].answer.outcome.sentence)}."
    kinds = Counter(run.answer.outcome.kind for run in runs)
    outcomes = "; ".join(f"{kind.words}: {kinds[kind]}" for kind in KINDS if kinds[kind])
    kept = sum(run.answer.whole_range.sentence == EVERY_START for run in runs)
    proved = f"; of {kept}, it is also proved that all motions stay in it" if kept else ""
    return (
        f"{counted(len(runs), 'run')}. {_capital(outcomes)}.{_common_desire(runs)} "
        f"This start: {_counts(run.answer.this_start for run in runs)}. "
        f"Whole range: {_counts(run.answer.whole_range for run in runs)}{proved}."
    )


def _counts(answers: Iterable[Answer]) -> str:
    """Return how many answers have each word, the surest first."""
    counts = Counter((list(Sureness).index(answer.sureness), answer.word) for answer in answers)
    return "; ".join(f"{word} ({count})" for (_, word), count in sorted(counts.items()))


def _first_at_rest(runs: Sequence[Run]) -> tuple[str, ...]:
    """Return a sentence that names the run that comes to rest first, of several of one body."""
    settled = sorted((run.settling_time, run.label) for run in runs if _settles(run))
    is_race = all(run.data.get("body") == runs[0].data.get("body") for run in runs)
    # Runs that are alike have no first one.
    if not settled or not is_race or number(settled[0][0]) == number(settled[-1][0]):
        return ()
    first, last = (f"{name}, from {number(time)} s on" for time, name in (settled[0], settled[-1]))
    others = [run.label for run in runs if not _settles(run)]
    without = f"; not by the end: {listed(others)}" if others else ""
    return (f"At rest first: {first}; last: {last}{without}.",)


def _settles(run: Run) -> bool:
    return not math.isnan(run.settling_time)


def _common_desire(runs: Sequence[Run]) -> str:
    """Return the desired attitude of all runs as a sentence; "" if they differ."""
    wishes = {str(wanted(run.config)) for run in runs}
    return f" Desired: {wishes.pop()}." if len(wishes) == 1 else ""


def _card(
    run: Run, sketch: Sketch | None, varying: Sequence[str], *, is_alone: bool, has_desire: bool
) -> Card:
    """Return a card that begins with the outcome, and with what is wrong."""
    # That of a single run has all answers in sentences. Of several runs, the words of those answers
    # that vary stand among the numbers; the table of answers has the sentences.
    answers = run.answer.answers
    statements = [
        Statement(
            question,
            answers[name].word,
            _capital(answers[name].sentence),
            answer_tone(answers[name]),
        )
        for name, question in QUESTIONS.items()
        if is_alone and name in answers
    ]
    facts = [(name, FACTS[name].text(run) or NO_VALUE) for name in NUMBERS]
    facts += [(name, FACTS[name].text(run)) for name in MORE_NUMBERS if is_alone]
    facts += [(name.replace("_", " "), answers[name].word) for name in varying]
    early = ended_early(run)
    return Card(
        run.label,
        (_outcome(run, has_desire=has_desire), *statements),
        tuple((name, text) for name, text in facts if text),
        target="certificates",
        sketch=sketch,
        alarm=f"ended early: {early}" if early else "",
    )


def _outcome(run: Run, *, has_desire: bool) -> Statement:
    """Return where the body rests, how far from where it should, and how surely."""
    outcome = run.answer.outcome
    where = outcome.sentence.partition(outcome.kind.words)[2].removesuffix(f": {outcome.sureness}")
    wish = f"Desired: {wanted(run.config)}" if has_desire else ""
    word = f"{_capital(outcome.brief)}: {outcome.sureness}"
    sentence = ". ".join(filter(None, (_capital(where.removeprefix(":").strip()), wish)))
    return Statement("Where does it rest?", word, sentence, outcome_tone(outcome))


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
