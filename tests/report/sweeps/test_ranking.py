"""Which condition of a sweep is better, and how surely: by failures, then by paired differences."""

import numpy as np
import pytest
from report.sweeps.cards import card_of
from scipy.stats import binom
from support.made_sweeps import SPIN, code

from rbstab.report.sweeps.conditions.paired_conditions import paired_conditions_of
from rbstab.report.sweeps.conditions.paired_difference import paired_difference
from rbstab.report.sweeps.conditions.ranking import is_alike

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
        "The time to come to rest (settling time of v; v is not the same function in each "
        "condition) is smallest with free. Next is visco-elastic: of these two, free has the "
        "smaller value in all 50 cases, by 0.5245 s in the median; with 95% confidence, this "
        "median is between 0.517 s and 0.532 s."
    )


def test_cases_against_the_median_are_counted(members):
    """So are those in which only one of both was at rest by its end: the other is later."""
    sentence = ranked(members, lambda point: np.select([point < 4, point < 9], [np.nan, -0.3], 0.5))
    assert "free has the smaller value in 41 of 50 cases, by 0.5 s in the median" in sentence
    assert "left out" not in sentence


def settling(members, columns):
    """The sentence on the settling times of a sweep with these columns."""
    sentences, _ = card_of(members(EACH, columns, design="random", members=50, seed=4))
    (sentence,) = [one for one in sentences if "come to rest" in one]
    return sentence


def test_the_condition_is_named_that_is_smaller_in_most_cases(members):
    """`free` has the larger median, since its few cases with large values have no partner."""

    def columns(a):
        variant, point = a["controller_variant"], a["run"] % 50
        times = np.where(variant == 1, 0.9, 1.0)
        times = np.where((variant == 1) & (point < 30), 2.0, times)
        early = np.where((variant == 0) & (point < 30), code("range left"), 0)
        return {"settling_time": np.where(variant == 2, 5.0, times), "status": early}

    sentence = settling(members, columns)
    assert "is smallest with free. Next is visco-elastic" in sentence
    assert "free has the smaller value in all 20 cases, by 0.1 s" in sentence
    assert sentence.endswith(
        "; 30 of 50 cases are left out, where neither run was at rest by its end, or one ended "
        "early."
    )


def test_a_condition_that_seldom_comes_to_rest_is_not_the_best(members):
    """Where visco-elastic is at rest, it is so two seconds earlier; in most cases it is not."""

    def columns(a):
        variant, point = a["controller_variant"], a["run"] % 50
        times = np.choose(variant, [np.where(point < 5, 8.0, np.nan), 10.0, np.nan])
        return {"settling_time": times}

    sentence = settling(members, columns)
    assert "is smallest with free" in sentence
    assert "free has the smaller value in 45 of 50 cases, by more than the runs last" in sentence


def test_without_a_condition_that_none_is_better_than_no_one_is_named(members):
    """Stone, paper and scissors: each of the three is better than one other in most cases."""

    def columns(a):
        third = (a["run"] % 50) % 3
        return {"settling_time": 1.0 + (a["controller_variant"] + third) % 3}

    sentence = settling(members, columns)
    assert sentence.endswith("none is better than all others; the table compares all pairs.")


def test_medians_of_different_cases_decide_nothing(members):
    """`free` is smaller in all cases in which others have a value, and alone in the long ones."""

    def columns(a):
        variant, point = a["controller_variant"], a["run"] % 50
        times = np.choose(variant, [10.0, np.where(point < 20, 5.0, 50.0), 12.0])
        early = np.where((variant != 1) & (point >= 20), code("range left"), 0)
        return {"settling_time": times, "status": early}

    assert "is smallest with free. Next is visco-elastic" in settling(members, columns)


def test_conditions_without_a_common_case_are_not_called_alike(members):
    def columns(a):
        variant, point = a["controller_variant"], a["run"] % 50
        left = np.where(variant == 2, point < 25, point >= 25)
        return {
            "settling_time": np.choose(variant, [1.0, 2.0, 9.0]),
            "status": np.where(left, code("range left"), 0),
        }

    sentence = settling(members, columns)
    assert "is smaller with visco-elastic than with free" in sentence
    assert sentence.endswith(" Without a common case with visco-elastic: permanent.")


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
        "with permanent, by construction. Of the others: it is smaller with free than with "
        "visco-elastic. Of these "
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
    assert is_alike(found, sampled=True) is not matters
    # The rule has no unit: millimetres do not matter more than metres.
    assert paired_difference(1e3 * (second + difference), 1e3 * second).matters is matters


def test_the_sentence_says_that_a_difference_does_not_matter(members):
    sentence = ranked(members, lambda point: 1e-5 + 0.0 * point)
    assert "no difference that matters between" in sentence
    assert (
        "The difference is 1e-05 s in the median of 50 cases, less than 1% of the values."
        in sentence
    )


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


@pytest.mark.parametrize("count", [9, 21, 51, 101, 2001])
def test_the_interval_is_that_of_a_bootstrap_with_infinitely_many_draws(count):
    """The median of n drawn values is at most the k-th if more than half of them are.

    Each is, with probability k/n. The ends of the bootstrap are the ranks at which 2.5 % and 97.5 %
    of the medians are reached.
    """
    found = paired_difference(np.arange(1.0, count + 1.0), np.zeros(count))
    ranks = np.arange(1, count + 1)
    reached = binom.sf(count // 2, count, ranks / count)
    low = int(ranks[np.searchsorted(reached, 0.025)])
    assert 0 <= low - found.low <= 1
    assert found.high == count + 1 - found.low


@pytest.mark.parametrize("count", [0, 3])
def test_few_pairs_say_nothing_sure(count):
    found = paired_difference(np.full(count, -1.0), np.zeros(count))
    assert (found.pairs, found.is_sure) == (count, False)


def test_equal_pairs_have_no_part_in_the_median():
    """In most cases both are equal; in the others the first is smaller by a tenth."""
    second = np.ones(100)
    first = np.where(np.arange(100) < 60, 1.0, 0.9)
    found = paired_difference(first, second)
    assert (found.pairs, found.equal, found.negative) == (40, 60, 1.0)
    assert found.median == pytest.approx(-0.1)
    assert found.matters
    # As the sentence, a mark speaks of most pairs.
    assert is_alike(found, sampled=True)
    most = paired_difference(first[50:], second[50:])
    assert (most.pairs, most.equal) == (40, 10)
    assert not is_alike(most, sampled=True)
    assert is_alike(paired_difference(second, second), sampled=True)


def test_a_twentieth_of_the_pairs_is_beyond_each_end():
    """Of the differences 1 to 101: 5 are below 6, 5 above 96."""
    found = paired_difference(np.arange(1.0, 102.0), np.zeros(101))
    assert found.ends == (6.0, 96.0)


def peaks(members, of_each):
    """The sentence on the displacement of a sweep, of which each variant has its values."""

    def columns(a):
        variant, point = a["controller_variant"], a["run"] % 50
        peak = np.choose(variant, [values(point) for values in of_each])
        return {"peak_contact_displacement": peak[:, np.newaxis] * np.ones(3)}

    sentences, _ = card_of(members(EACH, columns, design="random", members=50, seed=4))
    (sentence,) = [one for one in sentences if "displacement" in one]
    return sentence


def smaller_from(members, first):
    """The sentence on a sweep in which `free` is smaller from a case on, and equal before."""
    return peaks(
        members,
        (
            lambda point: 1.0 + point,
            lambda point: 1.0 + point - 0.5 * (point >= first),
            lambda point: 99.0 + point,
        ),
    )


def test_cases_that_are_equal_are_counted(members):
    """The largest displacement is often that at the start, which is the same."""
    sentence = smaller_from(members, 20)
    assert "free has the smaller value in all 30 cases, by 0.5 m in the median" in sentence
    assert sentence.endswith(
        "; in 20 further cases both are equal, as where the largest value is that at the start."
    )


def test_all_conditions_that_are_alike_are_named(members):
    alike = (lambda point: 1.0 + point, lambda point: 1.0 + point + 1e-7 * (point - 9.5))
    sentence = peaks(members, (*alike, alike[0]))
    assert sentence.endswith(
        "no difference that matters between visco-elastic, permanent and free."
    )
    sentence = peaks(members, (*alike, lambda point: 9.0 + point))
    assert "between visco-elastic and free, which have the smallest values" in sentence


def failed(members, of_first, of_second):
    """The sentences on a sweep in which some of the 50 runs of each condition left the range."""

    def columns(a):
        point = a["run"] % 50
        left = np.where(a["body_mass"] == 1, of_first(point), of_second(point))
        return {"status": np.where(left, code("range left"), 0)}

    vary = {"body.mass": {"each": {"values": [1, 2]}}, f"{SPIN}[0]": {"normal": [0, 6]}}
    return card_of(members(vary, columns, design="random", members=50, seed=4))[0]


def test_the_extremes_of_many_conditions_are_found_by_chance_too(members):
    """Of six pairs, one has the probability 6 x 2 (1/2)⁷ = 9 %: more than 5 %."""

    def sentence(count):
        def columns(a):
            left = (a["body_mass"] == 4) & (a["run"] % 50 < count)
            return {"status": np.where(left, code("range left"), 0)}

        vary = {"body.mass": {"each": {"values": [1, 2, 3, 4]}}, f"{SPIN}[0]": {"normal": [0, 6]}}
        return card_of(members(vary, columns, design="random", members=50, seed=4))[0][2]

    assert "this may be chance (sign test, 95% confidence, these two chosen from 6" in sentence(7)
    assert "more than chance makes" in sentence(8)


def test_runs_that_ended_early_are_compared_first(members):
    sentences = failed(members, lambda point: point < 2, lambda point: point < 12)
    assert sentences[1:3] == [
        "Runs that ended early (left the range): mass = 1 kg: 2 of 50; mass = 2 kg: 12 of 50.",
        "In 10 of the same 50 cases only mass = 2 kg ended early, in 0 only mass = 1 kg: "
        "more than chance makes (sign test, 95% confidence).",
    ]


def test_few_runs_that_ended_early_may_be_chance(members):
    """Five against none has the probability 2 (1/2)⁵ = 6 %: more than 5 %."""
    sentences = failed(members, lambda point: point < 0, lambda point: point < 5)
    assert sentences[2].endswith(
        "ended early, in 0 only mass = 1 kg: this may be chance (sign test, 95% confidence)."
    )
    sentences = failed(members, lambda point: point < 0, lambda point: point < 6)
    assert "more than chance makes" in sentences[2]


def test_where_no_run_ended_early_nothing_is_said_of_it(members):
    sentences = failed(members, lambda point: point < 0, lambda point: point < 0)
    assert not any("ended early" in sentence for sentence in sentences)


@pytest.mark.parametrize(("key", "own"), [("body.mass", True), (f"{SPIN}[1]", False)])
def test_conditions_may_have_a_function_v_of_their_own(members, key, own):
    vary = {key: {"each": {"values": [1, 2]}}, f"{SPIN}[0]": {"normal": [0, 6]}}
    groups = paired_conditions_of(members(vary, design="random", members=10, seed=4))
    assert groups is not None
    assert groups.has_own_v is own


def test_most_cases_decide_whether_conditions_are_alike(members):
    sentence = smaller_from(members, 40)
    assert "no difference that matters between visco-elastic and free" in sentence
    assert sentence.endswith("it is the same in 40 of 50 cases.")


def test_only_a_displacement_is_zero_by_construction(members):
    sentence = settling(
        members, lambda a: {"settling_time": np.choose(a["controller_variant"], [0.0, 1.0, 2.0])}
    )
    assert "by construction" not in sentence
    assert "is smallest with visco-elastic" in sentence


def test_the_size_of_a_difference_is_compared_with_the_values_that_are_known():
    """A value that is later than the end says nothing of how large the values are."""
    first = np.array([1.0, 1.0, 1.0, 9.0])
    second = np.array([1.5, 1.5, np.inf, np.inf])
    assert paired_difference(first, second).scale == 1.5
