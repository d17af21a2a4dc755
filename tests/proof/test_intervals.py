"""Arrays of intervals contain what they stand for: exact fractions, or balls of 300 bits."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support.balls import BITS, ball

from rbstab.proof.enclosures import intervals
from rbstab.proof.enclosures.intervals import Intervals

PLAIN = st.floats(-50, 50) | st.sampled_from([0.0, 1.0, -1.0, 0.5, np.pi, 1e-9])
WILD = st.floats(allow_nan=False, allow_infinity=False) | PLAIN
ENDLESS = WILD | st.sampled_from([np.inf, -np.inf])
SHARES = st.fractions(0, 1, max_denominator=64)

EXAMPLES = [
    pytest.param(20, id="some"),
    pytest.param(400, id="many", marks=pytest.mark.heavy),
]


@st.composite
def pairs(draw, ends=ENDLESS):
    """Return an interval, and a rational number in it."""
    low, high = sorted((draw(ends), draw(ends)))
    share = draw(SHARES)
    assume(low < np.inf and high > -np.inf)
    a = Fraction(low) if np.isfinite(low) else None
    b = Fraction(high) if np.isfinite(high) else None
    far = Fraction(10) ** draw(st.integers(-3, 400))
    if a is None and b is None:
        x = far * (2 * share - 1)
    elif a is None:
        x = b - far * share
    elif b is None:
        x = a + far * share
    else:
        x = a + (b - a) * share
    return Intervals(np.array([low]), np.array([high])), x


def fuzz(strategy, test, count):
    """Run a test for so many examples."""
    settings(deadline=None, max_examples=count, derandomize=count < 100)(given(strategy)(test))()


def holds(found, exact):
    low, high = found.lo[0], found.hi[0]
    assert not np.isnan(low)
    assert not np.isnan(high)
    assert low == -np.inf or Fraction(low) <= exact
    assert high == np.inf or exact <= Fraction(high)


def holds_ball(found, exact):
    low, high = float(found.lo[0]), float(found.hi[0])
    assert low == -np.inf or not ball(low) > exact
    assert high == np.inf or not ball(high) < exact
    assert not np.isnan(low)
    assert not np.isnan(high)


def is_tight(found, low, high, share=1e-13):
    """The ends are those of the exact image, but for round-off."""
    size = max(abs(low), abs(high), 1e-290)
    np.testing.assert_allclose([found.lo[0], found.hi[0]], [low, high], rtol=0, atol=share * size)


@pytest.mark.parametrize("count", EXAMPLES)
@pytest.mark.parametrize("end", ["mid", "mag"])
def test_middle_radius_and_magnitude_reach_the_ends(end, count):
    def test(one):
        x, exact = one
        if end == "mag":
            assert x.mag[0] == np.inf or abs(exact) <= Fraction(x.mag[0])
        elif np.isfinite(x.lo[0]) and np.isfinite(x.hi[0]):
            mid = x.mid[0]
            assert np.isfinite(mid)
            assert x.rad[0] == np.inf or abs(exact - Fraction(mid)) <= Fraction(x.rad[0])
        else:
            assert not x.rad[0] < np.inf

    fuzz(pairs(), test, count)


@pytest.mark.parametrize("count", EXAMPLES)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_product_contains_the_products(count):
    def test(two):
        (x, a), (y, b) = two
        holds(intervals.product(x, y), a * b)

    fuzz(st.tuples(pairs(), pairs()), test, count)


def test_a_product_is_sharp_for_all_signs():
    for a, b in ((2, 3), (-3, -2), (-2, 3)):
        for c, d in ((5, 7), (-7, -5), (-5, 7)):
            ends = [a * c, a * d, b * c, b * d]
            x, y = (
                Intervals(np.array([float(p)]), np.array([float(q)])) for p, q in ((a, b), (c, d))
            )
            is_tight(intervals.product(x, y), min(ends), max(ends))


@pytest.mark.parametrize("count", EXAMPLES)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_multiple_contains_the_multiples(count):
    def test(given_):
        (x, a), factor, share = given_
        holds(intervals.scaled(x, float(factor)), a * Fraction(float(factor)))
        about = intervals.constant(factor)
        holds(intervals.scaled(x, about), a * factor)
        wide = Intervals(about.lo - 1, about.hi + 1)
        inside = Fraction(float(wide.lo)) * share + Fraction(float(wide.hi)) * (1 - share)
        holds(intervals.scaled(x, wide), a * inside)

    fuzz(st.tuples(pairs(), st.fractions(-100, 100), SHARES), test, count)


@pytest.mark.parametrize("count", EXAMPLES)
def test_constants_are_in_their_doubles(count):
    def test(c):
        found = intervals.constant(c)
        holds(Intervals(found.lo[None], found.hi[None]), c)
        exact = Fraction(float(c)) == c
        assert (found.lo == found.hi) == exact

    fuzz(st.fractions() | st.floats(-9, 9).map(Fraction), test, count)


@pytest.mark.parametrize("count", EXAMPLES)
def test_what_is_in_both_is_kept(count):
    def test(two):
        (x, a), (y, _) = two
        both = intervals.met(x, y)
        inside = (y.lo[0] == -np.inf or Fraction(y.lo[0]) <= a) and (
            y.hi[0] == np.inf or a <= Fraction(y.hi[0])
        )
        low = both.lo[0] == -np.inf or Fraction(both.lo[0]) <= a
        high = both.hi[0] == np.inf or a <= Fraction(both.hi[0])
        assert (low and high) == inside

    fuzz(st.tuples(pairs(), pairs()), test, count)


@pytest.mark.parametrize("n", [-5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 7])
@pytest.mark.parametrize("count", EXAMPLES)
def test_a_power_contains_the_powers(n, count):
    def test(one):
        x, a = one
        assume(a != 0 or n >= 0)
        holds(intervals.power(x, n), a**n)

    fuzz(pairs(), test, count)


@pytest.mark.parametrize("n", [-3, -2, -1, 1, 2, 3, 4])
def test_a_power_is_sharp(n):
    for low, high in ((2.0, 3.0), (-3.0, -2.0), (-2.0, 3.0), (0.0, 3.0), (-3.0, 0.0)):
        x = Intervals(np.array([low]), np.array([high]))
        found = intervals.power(x, n)
        ends = sorted(np.array([low, high]) ** float(n)) if low * high > 0 else None
        if ends is not None:
            is_tight(found, *ends)
        elif n > 0:
            ends = sorted([low**n, high**n])
            is_tight(found, 0.0 if n % 2 == 0 else ends[0], ends[1])
        elif n % 2 == 0:  # one bound of 1/x² is known
            np.testing.assert_allclose(found.lo, 1 / max(low**-n, high**-n), rtol=1e-13)
            assert found.hi == np.inf
        else:
            assert np.isfinite(found.lo[0]) == (low == 0)
            assert np.isfinite(found.hi[0]) == (high == 0)


@pytest.mark.parametrize("count", EXAMPLES)
def test_a_root_contains_the_roots(count):
    def test(one):
        x, a = one
        assume(a >= 0)
        found = intervals.root(x)
        low, high = found.lo[0], found.hi[0]
        assert low <= 0 or Fraction(low) ** 2 <= a
        assert high == np.inf or a <= Fraction(high) ** 2

    fuzz(pairs(), test, count)


@pytest.mark.parametrize("name", ["exp", "log", "atan"])
@pytest.mark.parametrize("count", EXAMPLES)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_rising_function_contains_its_values(name, count):
    def test(one):
        x, a = one
        assume(name != "log" or x.lo[0] > 0)
        assume(name != "exp" or abs(a) < 10**6)
        found = intervals.monotone(name, x)
        with ctx.workprec(BITS):
            holds_ball(found, getattr(ball(a), name)())

    fuzz(pairs(), test, count)


def test_a_rising_function_is_sharp():
    x = Intervals(np.array([0.5]), np.array([2.0]))
    for name, function in (("exp", np.exp), ("log", np.log), ("atan", np.arctan)):
        is_tight(intervals.monotone(name, x), function(0.5), function(2.0))


@pytest.mark.parametrize("count", EXAMPLES)
@pytest.mark.parametrize("ends", ["plain", "narrow", "all"])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_sines_contain_their_values(ends, count):
    def test(one):
        x, a = one
        assume(abs(a) < Fraction(10) ** 40)
        s, c = intervals.sin_cos(x)
        with ctx.workprec(BITS + 200):
            holds_ball(s, ball(a).sin())
            holds_ball(c, ball(a).cos())

    quarter = st.integers(-9, 9).map(lambda k: k * np.pi / 2)
    near = st.tuples(quarter, st.floats(-1e-6, 1e-6)).map(sum)
    strategy = {"plain": PLAIN | quarter, "narrow": near, "all": ENDLESS}[ends]
    fuzz(pairs(strategy), test, count)


def test_sines_are_sharp():
    """From the monotone pieces of the sine; and ±1 where they are reached."""
    cases = [
        (0.1, 0.2, np.sin(0.1), np.sin(0.2)),
        (1.0, 2.0, np.sin(1.0), 1.0),
        (-2.0, 0.5, -1.0, np.sin(0.5)),
        (3.0, 3.5, np.sin(3.5), np.sin(3.0)),
        (0.0, 7.0, -1.0, 1.0),
    ]
    for low, high, least, most in cases:
        x = Intervals(np.array([low]), np.array([high]))
        is_tight(intervals.sin_cos(x)[0], least, most)
        quarter = Intervals(x.lo - np.pi / 2, x.hi - np.pi / 2)
        is_tight(intervals.sin_cos(quarter)[1], least, most)


def test_what_is_no_number_is_no_bound():
    found = intervals.outward(np.array([np.nan, 1.0]), np.array([np.nan, 2.0]))
    assert (found.lo[0], found.hi[0]) == (-np.inf, np.inf)
    assert found.lo[1] < 1.0
    assert found.hi[1] > 2.0


def test_a_sum_of_sixty_products_is_still_between_its_bounds():
    """Summed to nearest, without more slack: the slack of each product is for that."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        a, b = rng.normal(size=(2, 60)) * 10.0 ** rng.integers(-3, 3, size=(2, 60))
        found = intervals.product(Intervals(a, a), Intervals(b, b))
        exact = sum(Fraction(x) * Fraction(y) for x, y in zip(a, b, strict=True))
        assert Fraction(float(found.lo.sum())) <= exact <= Fraction(float(found.hi.sum()))


def test_the_balls_here_are_not_doubles():
    """An exact third is no double, and its ball is far sharper than one."""
    with ctx.workprec(BITS):
        third = ball(Fraction(1, 3))
        assert third.rad() < arb(2) ** -250
        assert not ball(1 / 3).overlaps(third)
