"""Protects interval arithmetic in doubles: a result contains all exact results, to the last bit.

Exact results are rational numbers, or balls of 400 bits for roots.
"""

from fractions import Fraction

import numpy as np
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st

from rbstab.analysis.proof.lines.intervals import Intervals, between, near, total

seeds = st.integers(0, 2**32)
COUNT = 20


def random_intervals(rng, positive=False):
    """Return intervals of many sizes; some have no width, so that only rounding is left."""
    middle = rng.normal(size=COUNT) * 10.0 ** rng.uniform(-3, 3, COUNT)
    radius = np.abs(middle) * rng.choice([0.0, 1e-16, 0.3, 0.9], COUNT)
    return Intervals(np.abs(middle) if positive else middle, radius)


def ends(interval):
    """Return the exact ends of each interval."""
    pairs = zip(interval.middle.tolist(), interval.radius.tolist(), strict=True)
    return [(Fraction(m) - Fraction(r), Fraction(m) + Fraction(r)) for m, r in pairs]


def assert_contains(interval, exact):
    """Assert that each interval contains the exact numbers at its place."""
    for (low, high), numbers in zip(ends(interval), exact, strict=True):
        assert all(low <= number <= high for number in numbers)


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_sums_and_products_contain_the_exact_ones(seed):
    rng = np.random.default_rng(seed)
    a, b = random_intervals(rng), random_intervals(rng)
    pairs = [
        [(x, y) for x in first for y in second]
        for first, second in zip(ends(a), ends(b), strict=True)
    ]
    assert_contains(a + b, [[x + y for x, y in some] for some in pairs])
    assert_contains(a * b, [[x * y for x, y in some] for some in pairs])
    assert_contains(total([a, b, a]), [[2 * x + y for x, y in some] for some in pairs])


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_bounds_are_outside_of_the_interval(seed):
    a = random_intervals(np.random.default_rng(seed))
    for (low, high), least, most, size in zip(ends(a), a.low, a.high, a.size, strict=True):
        assert Fraction(least) <= low
        assert Fraction(most) >= high
        assert Fraction(size) >= max(abs(low), abs(high))
    assert_contains(between(a.low, a.high), ends(a))


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_roots_and_their_reciprocal_powers_contain_the_exact_ones(seed):
    a = random_intervals(np.random.default_rng(seed), positive=True)
    found = {n: a.negative_power(n) for n in (1, 3, 5)}
    with ctx.workprec(400):
        for place, (middle, radius) in enumerate(zip(a.middle, a.radius, strict=True)):
            for x in (arb(middle) - arb(radius), arb(middle) + arb(radius)):
                assert abs(x.sqrt() - arb(a.root().middle[place])) <= arb(a.root().radius[place])
                for n, powers in found.items():
                    exact = 1 / x.sqrt() ** n
                    assert abs(exact - arb(powers.middle[place])) <= arb(powers.radius[place])


def test_a_number_that_may_be_zero_has_no_bounded_reciprocal():
    around_zero = Intervals(np.array([0.0, 1.0]), np.array([1.0, 1.0]))
    with np.errstate(all="ignore"):
        assert not np.any(around_zero.negative_power(1).size < np.inf)
    root = around_zero.root()
    assert np.all(root.low <= 0)
    assert np.all(root.high >= np.sqrt([1.0, 2.0]))


def test_a_number_stands_for_all_that_round_to_it():
    one = near(1.0)
    assert Fraction(float(one.radius)) >= Fraction(2) ** -53
