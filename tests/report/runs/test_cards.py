"""The cards of runs: what a reader wants to know first."""

import dataclasses
import math
import re

import numpy as np
import pytest
import yaml
from report.runs.stored import runs_of, store_proof, with_v
from support.made_runs import PEAKS, V_START, made_config, made_file, made_result
from support.results import with_data

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment.answers.assessed_run import RegionCheck
from rbstab.experiment.answers.facts import FACTS
from rbstab.experiment.answers.outcome import Outcome, OutcomeKind
from rbstab.experiment.answers.run_answer import Answer
from rbstab.experiment.answers.words import Sureness
from rbstab.experiment.convergence.convergence import Convergence
from rbstab.experiment.convergence.zero_description import APPROACHED
from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.stored_proof.starts import start_level
from rbstab.report.model.document import Cards
from rbstab.report.runs.answers import MAX_CARDS, answer_blocks, answer_sentence
from rbstab.store.result import write_result


def blocks_of(runs):
    return answer_blocks(runs)


def block_of(runs):
    *_, cards = blocks_of(runs)
    return cards


def cards_of(*paths):
    return block_of(runs_of(*paths)).cards


def test_each_run_has_a_card_unless_there_are_many(tmp_path):
    paths = [made_file(tmp_path / f"{k}.h5") for k in range(MAX_CARDS)]
    # Runs that are alike have no first one.
    sentence, cards = blocks_of(runs_of(*paths))
    assert sentence == (
        f"{MAX_CARDS} runs. Rests elsewhere: {MAX_CARDS}. Desired: upright (default), within 10°. "
        f"This start: seen ({MAX_CARDS}). Whole range: not decided ({MAX_CARDS})."
    )
    assert [card.title for card in cards.cards] == [str(k) for k in range(MAX_CARDS)]
    (outcome,) = cards.cards[0].statements
    assert re.fullmatch(r"Rests elsewhere, [0-9.]+° away: seen", outcome.word)
    assert outcome.sentence.endswith("° from the desired attitude")
    # In both answers the runs are alike, as the sentence says.
    assert list(dict(cards.cards[0].facts)) == ["at rest from", "peak |E|"]
    assert list(dict(cards.words))[:4] == ["proved", "seen", "false", "not decided"]
    more = blocks_of(runs_of(*paths, made_file(tmp_path / "more.h5")))
    assert not any(isinstance(block, Cards) for block in more)


@pytest.mark.parametrize(
    ("outcome", "word", "tone"),
    [
        (("returns", "proved", ""), "Returns: proved", "good"),
        (("returns", "seen", ""), "Returns: seen", "good"),
        # It may leave an unstable rest state at any time.
        (("returns", "seen", "an unstable rest state"), "Returns: seen", ""),
        # It is proved that the body has fallen over.
        (("rests_elsewhere", "proved", ""), "Rests elsewhere, 67.7° away: proved", "warning"),
        (("moving", "proved", ""), "Still moving: proved", ""),
        (("left_range", "seen", ""), "Left the range: seen", "bad"),
        (("failed", "not decided", "diverged"), "Failed: not decided", "bad"),
    ],
)
def test_a_card_begins_with_the_outcome(outcome, word, tone, tmp_path):
    """Green is only for a body that rests where it should."""
    kind, sureness, why = outcome
    pose = (0.0, math.radians(67.7), 0.0)
    outcome = Outcome(OutcomeKind(kind), Sureness(sureness), 5.0, pose, pose[1], None, why)
    (run,) = runs_of(made_file(tmp_path / "a.h5"))
    proved = Answer(Sureness.PROVED, "it converges")
    sentence, cards = blocks_of([with_answers(run, outcome=outcome, this_start=proved)])
    first, this_start, _ = cards.cards[0].statements
    assert (first.word, first.tone) == (word, tone)
    assert "at (0°, 67.7°, 0°), 67.7° from the desired attitude" in first.sentence.lower()
    assert (this_start.word, this_start.tone) == ("proved", "")
    assert sentence.startswith(outcome.sentence.capitalize()[:9])


def test_the_summary_counts_all_answers(tmp_path):
    """Also those that say of which starts they are."""
    (run,) = runs_of(made_file(tmp_path / "a.h5"))
    every = Answer(Sureness.PROVED, "it converges", "returns")
    almost = Answer(Sureness.PROVED, "it converges", "almost every start rests elsewhere")
    open_question = Answer(Sureness.NOT_DECIDED, "it is unknown")
    several = [
        with_answers(run, whole_range=answer) for answer in (open_question, almost, every, almost)
    ]
    assert answer_sentence(several).endswith(
        " Whole range: almost every start rests elsewhere: proved (2); returns: proved (1); "
        "not decided (1)."
    )


def with_answers(run, **answers):
    """Return a run with other answers."""
    changed = dataclasses.replace(run)
    changed.answer = run.answer._replace(**answers)
    return changed


def margin_on_card(path):
    return dict(cards_of(path)[0].facts).get("v(0)/c*")


def test_a_card_shows_the_margin_to_the_region(tmp_path):
    """The level is about v from the lowest rest state; the v of a run may count from another."""
    path = made_file(tmp_path / "made.h5")
    store_proof(tmp_path, made_config(), 1)
    config = load_config(yaml.safe_load(made_config()))
    proof = cached_proof(tmp_path, config)
    assert proof is not None
    start = start_level(problem_of(config), proof)
    assert start is not None
    assert start != pytest.approx(V_START)
    store_proof(tmp_path, made_config(), 1, level=4 * start)
    assert margin_on_card(path) == "0.25"
    # The card has both v(0), so that the number can be checked.
    numbers = dict(cards_of(path)[0].facts)
    assert numbers["v(0)"] == f"{V_START:.4g} J"
    assert numbers["start above the rest state of c*"] == f"{start:.4g} J"
    assert "v(0)/c*" in dict(block_of(runs_of(path)).words)
    without = block_of(runs_of(made_file(tmp_path / "other" / "unproved.h5")))
    assert "c*" not in without.note
    assert list(dict(without.words))[-3:] == ["v(0)", "peak |E|", "peak |θ2|"]


def test_a_run_that_ended_early_says_so_first(tmp_path):
    path = made_file(tmp_path / "a.h5", status="range left")
    assert cards_of(path)[0].alarm == "ended early: range left at 2 s"
    assert cards_of(made_file(tmp_path / "b.h5"))[0].alarm == ""


def test_who_is_at_rest_first_and_who_is_not(tmp_path):
    early = made_file(tmp_path / "early.h5")
    slower = with_v(tmp_path / "other.h5", lambda _, v: v**0.9 * V_START**0.1, 0.96)
    late = with_v(tmp_path / "late.h5", lambda _, v: np.full_like(v, V_START))
    _, sentence, _ = blocks_of(runs_of(early, slower, late))
    assert sentence.startswith("At rest first: early, from ")
    assert "; last: other, from " in sentence
    assert sentence.endswith("; not by the end: late.")
    cards = cards_of(early, late)
    facts = [[dict(card.facts)[name] for name in ("this start", "at rest from")] for card in cards]
    assert facts == [["seen", "0.8635 s"], ["not decided", "-"]]


def test_a_peak_that_the_samples_do_not_show_is_explained(tmp_path):
    """The error of the largest |E| is not known."""
    fast = with_data(made_result(), "peak_distance_error", np.array(np.nan))
    write_result(tmp_path / "fast.h5", fast)
    cards = block_of(runs_of(tmp_path / "fast.h5"))
    assert dict(cards.cards[0].facts)["peak |E|"].startswith("≥ ")
    assert "≥" in dict(cards.words)["peak |E|"]
    (entry,) = runs_of(made_file(tmp_path / "a.h5"))
    assert FACTS["peak |E|"].text(entry) == f"{np.linalg.norm(PEAKS):.4g} m"


@pytest.mark.parametrize(
    ("inside", "rest_state", "zero", "margin"),
    [
        # The start is inside: both count from the rest state of the region.
        (True, 2, "", "0.5"),
        # The motion is proved to come to the lowest rest state, as the region does.
        (False, 1, "", "2.5"),
        # It comes to another one: only a run that approaches it counts from there.
        (False, 2, APPROACHED, f"{V_START / 40:.4g}"),
        (False, 2, "the lowest rest state", None),
    ],
)
def test_both_numbers_of_the_margin_count_from_one_rest_state(
    inside, rest_state, zero, margin, tmp_path
):
    (run,) = runs_of(made_file(tmp_path / "a.h5", lyapunov_zero=zero))
    run.region = RegionCheck(inside, 100.0, 200.0)
    run.convergence = Convergence(True, rest_state=rest_state, bound=40.0)
    assert dict(block_of([run]).cards[0].facts).get("v(0)/c*") == margin
