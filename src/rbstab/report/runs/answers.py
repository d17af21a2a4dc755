"""The answers of runs: a sentence, and a card for each run."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import starmap

import numpy as np

from rbstab.analysis.settling import SETTLED_FRACTION
from rbstab.experiment.answers.outcome import KINDS
from rbstab.experiment.answers.run_answer import SETTLED, SETTLED_DRIVEN, STARTS_AT_REST, Answer
from rbstab.experiment.answers.wanted import wanted
from rbstab.experiment.answers.words import Sureness, meanings, words_with_meanings
from rbstab.experiment.convergence.convergence import EVERY_START
from rbstab.experiment.summary import at_least, at_rest_from, lyapunov_function_of
from rbstab.integrate.status import RunStatus
from rbstab.report.model.document import Block, Card, Cards, Sketch, Statement
from rbstab.report.model.words import NO_VALUE, counted, listed, number
from rbstab.report.reading.sources import Run
from rbstab.report.runs.config_tables import own_keys
from rbstab.report.runs.facts import RunFacts
from rbstab.report.runs.margin import counts_from_other_state, margin_of
from rbstab.report.runs.sketches import decay_sketches
from rbstab.report.runs.tables import ANSWER_TONES, outcome_tone

MAX_CARDS = 12
"""If there are more runs, their answers stand in the table of runs only."""

WHERE = "Where does it rest?"

QUESTIONS = {
    "this_start": "From this start: does it come to rest?",
    "whole_range": "From the whole range: where does it come to rest?",
    "pushes": "Which pushes does it survive?",
}
"""What a run is asked then; the names are those of `RunAnswer.answers`."""

ALL_MOTIONS = "All motions that stay in the range, and keep a distance from θ2 = ±π/2"

OTHER_START = "start above the rest state of c*"
"""Name of v(0) as it is compared with the certified region, if that of the run is another."""

MARGIN = "v(0)/c*"
"""Name of the number that compares a start with the certified region."""

SYMBOLS = {
    "at rest from": (
        "at rest from",
        f"{SETTLED} from then on; where inputs supply power, {SETTLED_DRIVEN}. "
        f"{STARTS_AT_REST}. ≤: the samples do not show it better",
    ),
    "v(0)": (
        "v(0)",
        "the Lyapunov function v at the start; v is an energy that damping takes away, zero at the "
        "rest state below the end of the motion",
    ),
    MARGIN: (
        MARGIN,
        "c* is a level of v below which every motion is proved to converge; here both count from "
        "the rest state of that proof. Below 1 the start has the proof, above 1 nothing follows",
    ),
    "peak |E|": ("E", "the displacement of the contact point from its anchor"),
    "peak |θ2|": (
        "θ2",
        "the second Euler angle. The range is |θ2| < π/2 rad, a right angle, and |θ1| and |θ3| < π",
    ),
}
"""The symbols of the numbers on the cards, and their meanings."""

DAMPERS = "L_"
"""First letters of the keys of a controller that v does not depend on."""

NOT_RESOLVED = (
    "≥",
    "the samples do not show the peak: between them the value may be larger",
)
"""What stands before a peak of the samples, and its meaning."""


def answer_blocks(facts: Sequence[RunFacts]) -> tuple[Block, ...]:
    """Return the sentence, the cards, and what the words mean."""
    sentences = answer_sentence(facts), *_first_at_rest(facts)
    if len(facts) > MAX_CARDS:
        return (*sentences, meanings())
    sketches = decay_sketches([entry.run for entry in facts])
    special = own_keys(facts) if len(facts) > 1 else [""]
    cards = tuple(starmap(_card, zip(facts, special, sketches, strict=True)))
    return (*sentences, Cards("answers", cards, (*words_with_meanings(), *_symbols(cards))))


def _symbols(cards: Sequence[Card]) -> tuple[tuple[str, str], ...]:
    """Return the symbols that stand on one of the cards, with their meanings."""
    shown = {name for card in cards for name, _ in card.facts}
    symbols = [symbol for name, symbol in SYMBOLS.items() if name in shown]
    if any(value.startswith(at_least(resolved=False)) for card in cards for _, value in card.facts):
        symbols.append(NOT_RESOLVED)
    return tuple(symbols)


def answer_sentence(facts: Sequence[RunFacts]) -> str:
    """Return a sentence with the outcomes and the answers of all runs."""
    if len(facts) == 1:
        answer = facts[0].answer
        return (
            f"{_capital(answer.outcome.sentence)}. Desired: {wanted(facts[0].run.config)}. "
            f"Comes to rest from this start: {answer.this_start.word}. "
            f"{ALL_MOTIONS}: {answer.whole_range.word}."
        )
    kinds = Counter(entry.answer.outcome.kind for entry in facts)
    outcomes = "; ".join(f"{kind.words}: {kinds[kind]}" for kind in KINDS if kinds[kind])
    return (
        f"{counted(len(facts), 'run')}. {_capital(outcomes)}. "
        f"Comes to rest from its start: {_counts(entry.answer.this_start for entry in facts)}. "
        f"{ALL_MOTIONS}: {_counts(entry.answer.whole_range for entry in facts)}{_kept(facts)}."
    )


def _kept(facts: Sequence[RunFacts]) -> str:
    """Return of how many runs it is proved that every motion stays in the range."""
    kept = sum(entry.answer.whole_range.sentence == EVERY_START for entry in facts)
    return f"; of {kept}, it is also proved that all motions stay in it" if kept else ""


def _first_at_rest(facts: Sequence[RunFacts]) -> tuple[str, ...]:
    """Return a sentence that names the run that comes to rest first, of several of one body."""
    bodies = [entry.run.data.get("body") for entry in facts]
    times = [(entry.run.settling_time, entry.run.label) for entry in facts]
    settled = sorted(entry for entry in times if not math.isnan(entry[0]))
    if len(settled) < 2 or any(body != bodies[0] for body in bodies):
        return ()
    (first, label), (last, last_label) = settled[0], settled[-1]
    named = f"At rest first: {label}, from {number(first)} s on; last: {last_label}, from"
    if number(first) == number(last):
        named = f"At rest at the same time: {listed(label for _, label in settled)}, from"
    others = [label for time, label in times if math.isnan(time)]
    without = f"; not by the end: {listed(others)}" if others else ""
    each = "" if _share_v(facts) else "; each run has its own v"
    settled_v = f"v stays below v(0)/{1 / SETTLED_FRACTION:g}{each}"
    return (f"{named} {number(last)} s on{without} ({settled_v}).",)


def _share_v(facts: Sequence[RunFacts]) -> bool:
    """Return whether runs of one body have the same Lyapunov function: all but their dampers."""

    def stored_energy(run: Run) -> list[object]:
        controller = run.data.get("controller")
        springs = dict(controller) if isinstance(controller, Mapping) else {}
        kept = {key: value for key, value in springs.items() if not key.startswith(DAMPERS)}
        return [kept, run.data.get("elements"), run.data.get("gravity")]

    first, *others = (stored_energy(entry.run) for entry in facts)
    return all(found == first for found in others)


def _counts(answers: Iterable[Answer]) -> str:
    """Return how many answers have each word, the surest first."""
    counts = Counter((list(Sureness).index(one.sureness), one.word) for one in answers)
    return "; ".join(f"{word} ({count})" for (_, word), count in sorted(counts.items()))


def _card(facts: RunFacts, special: str, sketch: Sketch | None) -> Card:
    """Return the card of a run.

    Args:
        facts: What is known of the run.
        special: In which keys of its config it differs from the others; "" for none.
        sketch: Its picture.
    """
    statements = (
        _outcome(facts),
        *(_statement(QUESTIONS[name], answer) for name, answer in facts.answer.answers.items()),
    )
    s, settled = facts.run.summary, at_rest_from(facts.run.result)
    status = facts.run.result.status
    early = f"ended early: {status} at {number(s.end_time)} s"
    numbers = {
        "differs in": special,
        "at rest from": f"{settled} s" if settled else NO_VALUE,
        "v(0)": f"{number(s.lyapunov_start)} J",
        OTHER_START: _other_start(facts),
        "largest v": largest_v(facts.run),
        MARGIN: _margin(facts),
        "peak |E|": f"{at_least(s.displacement_resolved)}{number(s.peak_distance)} m",
        "peak |θ2|": f"{at_least(s.pitch_resolved)}{number(s.largest_pitch)} rad",
        "warnings": str(len(facts.attribute("warnings").splitlines()) or ""),
    }
    shown = tuple((name, text) for name, text in numbers.items() if text)
    return Card(
        facts.run.label,
        statements,
        shown,
        target="certificates",
        sketch=sketch,
        alarm="" if status == RunStatus.COMPLETED else early,
    )


def largest_v(run: Run) -> str:
    """Return the largest v of a run that inputs drive, with its time; "" of another run."""
    v = np.asarray(lyapunov_function_of(run.result), dtype=float)
    if not run.is_driven or not np.any(np.isfinite(v)):
        return ""
    place = int(np.nanargmax(v))
    return f"{number(v[place])} J at {number(run.result['time'][place])} s"


def _other_start(facts: RunFacts) -> str:
    """Return v(0) as it is compared with the certified region; "" if it is that of the run."""
    margin = margin_of(facts)
    if margin is None or not counts_from_other_state(margin, facts):
        return ""
    return f"{number(margin.start)} J"


def _margin(facts: RunFacts) -> str:
    """Return v(0) over the level c* of a certified region, or "" if no level is proved."""
    margin = margin_of(facts)
    return "" if margin is None else number(margin.ratio)


def _outcome(facts: RunFacts) -> Statement:
    """Return where the body rests, how far from where it should, and how surely."""
    outcome = facts.answer.outcome
    where = outcome.sentence.partition(outcome.kind.words)[2].removesuffix(f": {outcome.sureness}")
    sentences = (_capital(where.removeprefix(":").strip()), f"Desired: {wanted(facts.run.config)}")
    word = f"{_capital(outcome.brief)}: {outcome.sureness}"
    return Statement(WHERE, word, ". ".join(filter(None, sentences)), outcome_tone(outcome))


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _statement(question: str, answer: Answer) -> Statement:
    tone = ANSWER_TONES.get(answer.sureness, "")
    return Statement(question, answer.word, _capital(answer.sentence), tone)
