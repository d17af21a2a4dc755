"""The card of a sweep says how many members come to rest, and how surely; and which is better."""

import numpy as np
import pytest
from support.made_sweeps import GRID, SPIN, code

from rbstab.report.model.document import Cards
from rbstab.report.sweeps.answers import answer_blocks
from rbstab.report.sweeps.conditions.ranking import _cell, paired_difference
from rbstab.sweep.proofs.columns import CONVERGENCE


def card_of(members):
    *sentences, cards = answer_blocks("sweep-1", "made", members)
    assert isinstance(cards, Cards)
    (card,) = cards.cards
    return sentences, card


def convergence(word):
    return CONVERGENCE.index(word)


def test_without_a_proof_the_end_of_the_runs_is_seen(members):
    sentences, card = card_of(
        members(GRID, lambda a: {"settling_time": np.where(a["run"] < 15, 1.0, np.nan)})
    )
    rest, in_range = card.statements
    assert (rest.word, in_range.word) == ("15 of 20 seen", "seen")
    assert rest.sentence == (
        "Not proved: no proof was made for any of the 20 members; of the 20 members, 15 were at "
        "rest by the end of their computed run; 5 were not, or their run ended early"
    )
    assert dict(card.facts)["not at rest by the end"] == "5"
    assert sentences == []


def test_proved_is_said_only_of_all_members(members):
    def proved(count):
        def columns(a):
            words = convergence("proved"), convergence("not decided")
            return {"convergence": np.where(a["run"] < count, *words)}

        return card_of(members(GRID, columns, prove="motion"))[1].statements[0]

    whole, part = proved(20), proved(10)
    assert (whole.word, whole.tone) == ("proved", "good")
    assert (part.word, part.tone) == ("10 of 20 proved", "")
    assert part.sentence.startswith(
        "10 of 20 are proved to converge to a rest state; of the 10 others, "
    )


def test_one_counterexample_is_enough(members):
    def columns(a):
        return {"convergence": np.where(a["run"] == 3, convergence("false"), convergence("proved"))}

    _, card = card_of(members(GRID, columns, prove="motion"))
    assert (card.statements[0].word, card.statements[0].tone) == ("false", "bad")
    assert "1 are proved not to come to rest" in card.statements[0].sentence


def test_a_member_is_counted_once(members):
    """A member that is proved not to come to rest may look as if it did in its computed run."""

    def columns(a):
        words = convergence("false"), convergence("not decided")
        return {"convergence": np.where(a["run"] < 5, *words), "settling_time": 1.0 + 0 * a["run"]}

    _, card = card_of(members(GRID, columns, prove="motion"))
    assert card.statements[0].sentence.endswith(
        "5 are proved not to come to rest; of the 15 others, all were at rest by the end of their "
        "computed run"
    )


def test_members_that_left_the_range(members):
    _, card = card_of(
        members(GRID, lambda a: {"status": np.where(a["run"] < 4, code("range left"), 0)})
    )
    stay = card.statements[1]
    assert (stay.word, stay.sentence, stay.tone) == ("false", "4 of 20 left it, as computed", "bad")


EACH = {
    "controller.variant": {"each": {"values": ["visco-elastic", "free", "permanent"]}},
    f"{SPIN}[0]": {"normal": [0, 6]},
}


def ranked(members, difference):
    """The sentence on a sweep in which `free` settles by some differences earlier."""

    def columns(a):
        variant, point = a["controller_variant"], a["run"] % 50
        noise = np.random.default_rng(1).normal(size=50)[point]
        settling = 2.0 + 0.1 * noise + np.where(variant == 1, -difference(point), 0.0)
        return {"settling_time": settling + np.where(variant == 2, 1.0, 0.0)}

    sentences, _ = card_of(members(EACH, columns, design="random", members=50, seed=4))
    assert sentences[0] == (
        "This sweep compares 3 variants: visco-elastic, free, permanent. Each of them ran in the "
        "same 50 cases, that is, from the same start and with the same numbers otherwise."
    )
    return sentences[1]


def test_the_better_condition_with_its_interval(members):
    sentence = ranked(members, lambda point: 0.5 + 0.001 * point)
    assert sentence == (
        "The time to come to rest (settling time of v) is smallest with free and second smallest "
        "with visco-elastic. Of these two, free has the smaller value in all 50 cases, by 0.5245 s "
        "in the median; with 95% confidence, this median is between 0.517 and 0.532 s."
    )


def test_cases_without_a_value_or_against_the_median_are_counted(members):
    sentence = ranked(members, lambda point: np.select([point < 4, point < 9], [np.nan, -0.3], 0.5))
    assert "free has the smaller value in 41 of 46 cases, by 0.5 s in the median" in sentence
    assert sentence.endswith("; 4 of 50 cases are left out, where a run has no value.")


def test_the_condition_is_named_that_is_smaller_in_most_cases(members):
    """`free` has the larger median, since its few cases with large values have no partner."""

    def columns(a):
        variant, point = a["controller_variant"], a["run"] % 50
        settling = np.where(variant == 1, 0.9, 1.0)
        settling = np.where((variant == 1) & (point < 30), 2.0, settling)
        settling = np.where((variant == 0) & (point < 30), np.nan, settling)
        return {"settling_time": np.where(variant == 2, 5.0, settling)}

    sentences, _ = card_of(members(EACH, columns, design="random", members=50, seed=4))
    assert "free has the smaller value in all 20 cases, by 0.1 s" in sentences[1]


def test_a_condition_that_holds_the_contact_point_is_not_called_the_best(members):
    """Its displacement is zero by construction."""

    def columns(a):
        variant, point = a["controller_variant"], a["run"] % 50
        peak = np.where(variant == 2, 0.0, 0.1 + 0.001 * point + 0.05 * (variant == 0))
        return {"peak_contact_displacement": peak[:, np.newaxis] * np.ones(3)}

    sentences, _ = card_of(members(EACH, columns, design="random", members=50, seed=4))
    (sentence,) = [one for one in sentences if "displacement" in one]
    assert sentence.startswith(
        "The largest displacement of the contact point (largest |E1|, |E2| or |E3|) is always 0 "
        "with permanent. Of the others, it is smaller with free than with visco-elastic. Of these "
    )


def test_a_difference_that_may_be_chance_is_not_called_one(members):
    sentence = ranked(members, lambda point: np.where(point % 2 == 0, 0.1, -0.09))
    assert "no sure difference between" in sentence


@pytest.mark.parametrize(("difference", "matters"), [(3e-6, False), (0.011, True)])
def test_a_sure_difference_of_less_than_a_hundredth_does_not_matter(difference, matters):
    """Every member of one condition is larger, by 3 µm of some 1 m or by a little more than 1 %."""
    second = np.linspace(0.8, 1.2, 41)
    found = paired_difference(second + difference, second)
    assert found.is_sure
    assert found.matters is matters
    assert _cell(found).tone == ("bad" if matters else "")
    # The rule has no unit: millimetres do not matter more than metres.
    assert paired_difference(1e3 * (second + difference), 1e3 * second).matters is matters


def test_the_sentence_says_that_a_difference_does_not_matter(members):
    sentence = ranked(members, lambda point: 1e-5 + 0.0 * point)
    assert "no difference that matters between" in sentence
    assert "It is 1e-05 s in the median of 50 cases, less than 1% of the values." in sentence


def test_the_interval_of_the_median_holds_as_often_as_it_says():
    """Of samples from a distribution with median 1, some 95 % of the intervals contain 1."""
    rng = np.random.default_rng(7)
    inside = []
    for _ in range(2000):
        sample = rng.exponential(1.0 / np.log(2.0), size=40)
        found = paired_difference(sample, np.zeros(40))
        inside.append(found.low <= 1.0 <= found.high)
    # The binomial is discrete: the interval is at least as wide as asked. With 40 pairs the exact
    # probability is 0.9615; 2000 trials spread by 0.0043.
    assert 0.95 < np.mean(inside) < 0.975


@pytest.mark.parametrize("count", [0, 3])
def test_few_pairs_say_nothing_sure(count):
    found = paired_difference(np.full(count, -1.0), np.zeros(count))
    assert (found.pairs, found.is_sure) == (count, False)
