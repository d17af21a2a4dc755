"""Which condition of a sweep is better, and how surely: by failures, then by paired differences."""

import numpy as np
import pytest
from report.sweeps.cards import answered
from scipy.stats import binom
from support.made_sweeps import SPIN, code

from rbstab.report.sweeps.conditions.paired_difference import paired_difference

EACH = {
    "controller.variant": {"each": {"values": ["visco-elastic", "free", "permanent"]}},
    f"{SPIN}[0]": {"normal": [0, 6]},
}
DRAWN = {"design": "random", "members": 50, "seed": 4}


def sentence_on(members, column, values, early=None, word="come to rest"):
    """The sentence on a column that is a function of the point, by variant."""

    def columns(a):
        variant, point = a["controller_variant"], a["run"] % 50
        numbers = np.choose(variant, [function(point) for function in values])
        left = np.zeros(len(numbers)) if early is None else early(variant, point)
        is_vector = column == "peak_contact_displacement"
        return {
            column: np.outer(numbers, np.ones(3)) if is_vector else numbers,
            "status": np.where(left, code("range left"), 0),
        }

    sentences = answered(members(EACH, columns, **DRAWN)).sentences
    (sentence,) = [text for text in sentences if word in text]
    return sentence


TIME = "The time to come to rest (settling time of v, each of its own v)"


def noisy(point):
    return 2.0 + 0.1 * np.random.default_rng(1).normal(size=50)[point]


@pytest.mark.parametrize(
    ("difference", "text"),
    [
        # Numbers of an independent computation: the 18th and the 33rd of 50 sorted differences.
        (
            lambda p: 0.5 + 0.001 * p,
            " is smallest with free: smaller than with visco-elastic in all 50 cases, by 0.5245 s "
            "in the median (95% interval: 0.517 s to 0.532 s).",
        ),
        # So are those in which only one of both was at rest by its end: the other is later.
        (
            lambda p: np.select([p < 4, p < 9], [np.nan, -0.3], 0.5),
            " is smallest with free: smaller than with visco-elastic in 41 of the 50 cases, by "
            "0.5 s in the median (95% interval: 0.5 s to 0.5 s).",
        ),
        (
            lambda p: np.where(p % 2 == 0, 0.1, -0.09),
            " is smallest with free; no sure difference that matters from visco-elastic.",
        ),
    ],
    ids=["sure", "against the median", "chance"],
)
def test_the_better_condition_with_its_interval(members, difference, text):
    values = (noisy, lambda p: noisy(p) - difference(p), lambda p: noisy(p) + 1.0)
    assert sentence_on(members, "settling_time", values) == TIME + text


@pytest.mark.parametrize(
    ("values", "early", "text"),
    [
        # The few cases of `free` with large values have no partner.
        (
            (
                lambda p: 1.0 + 0.0 * p,
                lambda p: np.where(p < 30, 2.0, 0.9),
                lambda p: 5.0 + 0.0 * p,
            ),
            lambda variant, point: (variant == 0) & (point < 30),
            " is smallest with free: smaller than with visco-elastic in all 20 cases that differ, "
            "of 50, by 0.1 s in the median (95% interval: 0.1 s to 0.1 s).",
        ),
        # Where visco-elastic is at rest, it is so two seconds earlier; in most cases it is not.
        (
            (
                lambda p: np.where(p < 5, 8.0, np.nan),
                lambda p: 10.0 + 0.0 * p,
                lambda p: np.nan + 0.0 * p,
            ),
            None,
            " is smallest with free: smaller than with visco-elastic in 45 of the 50 cases, by "
            "more than the runs last in the median (95% interval: more than the runs last to more "
            "than the runs last).",
        ),
        # Stone, paper and scissors: each of the three is better than one other in most cases.
        (
            tuple(lambda p, k=k: 1.0 + (k + p % 3) % 3 for k in range(3)),
            None,
            ": none is better than all others.",
        ),
        # Conditions without a common case are not called alike.
        (
            (lambda p: 1.0 + 0.0 * p, lambda p: 2.0 + 0.0 * p, lambda p: 9.0 + 0.0 * p),
            lambda variant, point: np.where(variant == 2, point < 25, point >= 25),
            " is smallest with visco-elastic: smaller than with free in all 25 cases that differ, "
            "of 50, by 1 s in the median (95% interval: 1 s to 1 s).",
        ),
    ],
    ids=["most cases", "seldom at rest", "no best", "no common case"],
)
def test_pairs_decide_and_not_medians(members, values, early, text):
    assert sentence_on(members, "settling_time", values, early) == TIME + text


PEAK = "The largest displacement of the contact point (largest |E1|, |E2| or |E3|)"


@pytest.mark.parametrize(
    ("values", "text"),
    [
        # Its displacement is zero by construction: it is not called the best.
        (
            (lambda p: 0.15 + 0.001 * p, lambda p: 0.1 + 0.001 * p, lambda p: 0.0 * p),
            ", always 0 with permanent by construction, is smallest with free: smaller than with "
            "visco-elastic in all 50 cases, by 0.05 m in the median (95% interval: 0.05 m to "
            "0.05 m).",
        ),
        # The largest displacement is often that at the start, which is the same.
        (
            (lambda p: 1.0 + p, lambda p: 1.0 + p - 0.5 * (p >= 20), lambda p: 99.0 + p),
            " is smallest with free: smaller than with visco-elastic in all 30 cases that differ, "
            "of 50, by 0.5 m in the median (95% interval: 0.5 m to 0.5 m).",
        ),
        # In most cases both are the same.
        (
            (lambda p: 1.0 + p, lambda p: 1.0 + p - 0.5 * (p >= 40), lambda p: 99.0 + p),
            " is smallest with visco-elastic; no sure difference that matters from free.",
        ),
        (
            (lambda p: 1.0 + p, lambda p: 1.0 + p + 1e-7 * (p - 9.5), lambda p: 1.0 + p),
            ": no sure difference that matters between visco-elastic, permanent and free.",
        ),
    ],
    ids=["held", "equal", "mostly equal", "alike"],
)
def test_the_displacement_of_the_contact_point(members, values, text):
    column = "peak_contact_displacement"
    assert sentence_on(members, column, values, word="displacement") == PEAK + text


def failed(members, masses, of_mass):
    """The sentences on runs that left the range, of some of 50 of each condition."""
    vary = {"body.mass": {"each": {"values": masses}}, f"{SPIN}[0]": {"normal": [0, 6]}}

    def columns(a):
        left = a["run"] % 50 < np.array(of_mass)[a["body_mass"].astype(int) - 1]
        return {"status": np.where(left, code("range left"), 0)}

    sentences = answered(members(vary, columns, **DRAWN)).sentences
    return [
        sentence
        for sentence in sentences[1:]
        if "ended early" in sentence and "first" not in sentence
    ]


def test_runs_that_ended_early_are_compared(members):
    assert failed(members, [1, 2], [2, 12]) == [
        "Runs that ended early: mass = 1 kg: 2 of 50; mass = 2 kg: 12 of 50.",
        "In 10 of the same 50 cases only mass = 2 kg ended early, in 0 only mass = 1 kg: "
        "more than chance makes (sign test, 95% confidence).",
    ]
    assert failed(members, [1, 2], [0, 0]) == []


@pytest.mark.parametrize(
    ("masses", "early", "is_sure"),
    [
        # Five against none has the probability 2 (1/2)⁵ = 6 %: more than 5 %.
        ([1, 2], [0, 5], False),
        ([1, 2], [0, 6], True),
        # Of six pairs, one has the probability 6 x 2 (1/2)⁷ = 9 %.
        ([1, 2, 3, 4], [0, 0, 0, 7], False),
        ([1, 2, 3, 4], [0, 0, 0, 8], True),
    ],
)
def test_few_runs_that_ended_early_may_be_chance(members, masses, early, is_sure):
    sentence = failed(members, masses, early)[-1]
    chosen = ", these two chosen from 6 pairs" if len(masses) > 2 else ""
    sure = "more than chance makes" if is_sure else "this may be chance"
    assert sentence.endswith(f": {sure} (sign test, 95% confidence{chosen}).")


@pytest.mark.parametrize(("difference", "matters"), [(3e-6, False), (0.011, True)])
def test_a_sure_difference_of_less_than_a_hundredth_does_not_matter(difference, matters):
    """Every member of one condition is larger, by 3 µm of some 1 m or by a little more than 1 %."""
    second = np.linspace(0.8, 1.2, 41)
    paired = paired_difference(second + difference, second)
    assert paired.is_sure
    assert paired.matters is matters
    assert paired.is_alike(sampled=True) is not matters
    # The rule has no unit: millimetres do not matter more than metres.
    assert paired_difference(1e3 * (second + difference), 1e3 * second).matters is matters


@pytest.mark.parametrize("count", [9, 21, 51, 101, 2001])
def test_the_interval_is_that_of_a_bootstrap_with_infinitely_many_draws(count):
    """The median of n drawn values is at most the k-th if more than half of them are.

    Each is, with probability k/n. The ends of the bootstrap are the ranks at which 2.5 % and 97.5 %
    of the medians are reached.
    """
    paired = paired_difference(np.arange(1.0, count + 1.0), np.zeros(count))
    ranks = np.arange(1, count + 1)
    reached = binom.sf(count // 2, count, ranks / count)
    low = int(ranks[np.searchsorted(reached, 0.025)])
    assert 0 <= low - paired.low <= 1
    assert paired.high == count + 1 - paired.low


@pytest.mark.parametrize("count", [0, 3])
def test_few_pairs_say_nothing_sure(count):
    paired = paired_difference(np.full(count, -1.0), np.zeros(count))
    assert (paired.pairs, paired.is_sure) == (count, False)


def test_equal_pairs_have_no_part_in_the_median():
    """In most cases both are equal; in the others the first is smaller by a tenth."""
    second = np.ones(100)
    first = np.where(np.arange(100) < 60, 1.0, 0.9)
    paired = paired_difference(first, second)
    assert (paired.pairs, paired.equal, paired.negative) == (40, 60, 1.0)
    assert paired.median == pytest.approx(-0.1)
    assert paired.matters
    # As the sentence, a mark speaks of most pairs.
    assert paired.is_alike(sampled=True)
    most = paired_difference(first[50:], second[50:])
    assert (most.pairs, most.equal) == (40, 10)
    assert not most.is_alike(sampled=True)


def test_a_twentieth_of_the_pairs_is_beyond_each_end():
    """Of the differences 1 to 101: 5 are below 6, 5 above 96."""
    paired = paired_difference(np.arange(1.0, 102.0), np.zeros(101))
    assert paired.ends == (6.0, 96.0)


def test_the_size_of_a_difference_is_compared_with_the_values_that_are_known():
    """A value that is later than the end says nothing of how large the values are."""
    first = np.array([1.0, 1.0, 1.0, 9.0])
    second = np.array([1.5, 1.5, np.inf, np.inf])
    assert paired_difference(first, second).scale == 1.5
