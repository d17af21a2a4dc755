"""Arrays of intervals contain what they stand for: exact fractions, or balls of 300 bits."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from flint import ctx
from hypothesis import assume
from hypothesis import strategies as st
from support.balls import BITS, ball
from support.expressions import COUNTS, fuzz

from rbstab.proof.enclosures import intervals
from rbstab.proof.enclosures.intervals import Intervals

END = np.pi / 2
PLAIN = st.floats(-50, 50) | st.sampled_from([0.0, 1.0, -1.0, 0.5, np.pi, 1e-9])
WILD = st.floats(allow_nan=False, allow_infinity=False) | PLAIN
ENDLESS = WILD | st.sampled_from([np.inf, -np.inf])
SHARES = st.fractions(0, 1, max_denominator=64)
FACTORS = st.fractions(-100, 100)
QUARTER = st.integers(-9, 9).map(lambda k: k * np.pi / 2)
NEAR = st.tuples(QUARTER, st.floats(-1e-6, 1e-6)).map(sum)


@st.composite
def pairs(draw, ends=ENDLESS):
    """Return an interval, and a rational number in it."""
    low, high = sorted((draw(ends), draw(ends)))
    assume(low < np.inf and high > -np.inf)
    far = Fraction(10) ** draw(st.integers(-3, 400))
    a = Fraction(low) if np.isfinite(low) else None
    b = Fraction(high) if np.isfinite(high) else None
    if a is None:
        a = (-far if b is None else b) - far
    if b is None:
        b = a + 2 * far
    return between(low, high), a + (b - a) * draw(SHARES)


def between(low, high):
    return np.array([[float(low)], [float(high)]])


def holds(interval, exact):
    """Whether an interval contains a fraction, or what is known to a ball."""
    (low,), (high,) = interval
    assert not np.isnan([low, high]).any()
    number = Fraction if isinstance(exact, Fraction) else ball
    return not (
        (np.isfinite(low) and number(low) > exact) or (np.isfinite(high) and number(high) < exact)
    )


def multiples(x, factor):
    """Return multiples of an interval, with the exact factors that they stand for."""
    about = intervals.constant(factor)
    wide = about + intervals.SIGNS
    yield intervals.product(x, about), factor
    yield from ((intervals.product(wide, x), Fraction(float(end))) for end in wide[:, 0])
    yield intervals.negative(intervals.product(x, about)), -factor


def constants(c):
    interval = intervals.constant(c)
    yield interval, c
    assert (interval[0] == interval[1]) == (Fraction(float(c)) == c)


def parts(x, a):
    """Return intervals that have to contain a, by the middle, the radius and the magnitude."""
    x = Intervals.of(x)
    yield x.ends, a
    yield x.widened(0.1, 0.2).ends, a + Fraction(0.2)
    yield x.widened(0.1, 0.2).ends, a - Fraction(0.1)
    yield (x * x).ends, a * a
    yield between(-x.mag[0], x.mag[0]), a
    if np.isfinite(x.rad[0]):
        yield between(0, x.rad[0]), abs(a - Fraction(x.mid[0]))


def powers(x, a):
    yield from ((intervals.power(x, n), a**n) for n in range(-5, 8) if a != 0 or n >= 0)


def functions(x, a):
    if a >= 0:
        yield intervals.root(x), ball(a).sqrt()
    if x[0, 0] > 0:
        yield intervals.monotone("log", x), ball(a).log()
    if abs(a) < 10**6:
        yield intervals.monotone("exp", x), ball(a).exp()
    yield intervals.monotone("atan", x), ball(a).atan()


def sines(x, a):
    assume(abs(a) < Fraction(10) ** 40)
    s, c = intervals.sin_cos(x)
    yield s, ball(a).sin()
    yield c, ball(a).cos()


PAIRS, TWO = pairs(), st.tuples(pairs(), pairs())
OPERATIONS: dict[str, tuple[Any, ...]] = {
    "product": (lambda p, q: [(intervals.product(p[0], q[0]), p[1] * q[1])], pairs(), pairs()),
    "multiple": (lambda p, c: [(y, p[1] * f) for y, f in multiples(p[0], c)], PAIRS, FACTORS),
    "constant": (constants, st.fractions()),
    "parts": (lambda p: parts(*p), PAIRS),
    "power": (lambda p: powers(*p), PAIRS),
    "functions": (lambda p: functions(*p), PAIRS),
    "sines": (lambda p: sines(*p), pairs(PLAIN | QUARTER) | pairs(NEAR) | PAIRS),
}


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("name", OPERATIONS)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_an_operation_contains_the_exact_results(name, count):
    operation, *strategies = OPERATIONS[name]

    def test(given):
        with ctx.workprec(BITS + 200):
            assert all(holds(interval, exact) for interval, exact in operation(*given))

    fuzz(test, st.tuples(*strategies), count=2 * count)


def is_tight(interval, low, high):
    """The ends are those of the exact image, but for round-off."""
    size = 1e-13 * max(abs(low), abs(high), 1e-290)
    np.testing.assert_allclose(interval[:, 0], [low, high], rtol=0, atol=size)


def test_a_product_is_sharp_for_all_signs():
    for a, b in ((2, 3), (-3, -2), (-2, 3)):
        for c, d in ((5, 7), (-7, -5), (-5, 7)):
            ends = [a * c, a * d, b * c, b * d]
            is_tight(intervals.product(between(a, b), between(c, d)), min(ends), max(ends))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("n", [-3, -2, -1, 1, 2, 3, 4])
def test_a_power_is_sharp(n):
    for low, high in ((2.0, 3.0), (-3.0, -2.0), (-2.0, 3.0), (0.0, 3.0), (-3.0, 0.0)):
        image = intervals.power(between(low, high), n)
        if low * high > 0:
            is_tight(image, *sorted([low**n, high**n]))
        elif n > 0:
            ends = [low**n, high**n]
            is_tight(image, 0.0 if n % 2 == 0 else ends[0], max(ends))
        elif n % 2 == 0:  # one bound of 1/x² is known
            np.testing.assert_allclose(image[0], 1 / max(low**-n, high**-n), rtol=1e-13)
            assert image[1] == np.inf
        else:
            assert np.isfinite(image[:, 0]).tolist() == [low == 0, high == 0]


@pytest.mark.parametrize(
    ("low", "high", "least", "most"),
    [
        (0.1, 0.2, 0.1, 0.2),
        (1, 2, 1, END),
        (-2, 0.5, -END, 0.5),
        (3, 3.5, 3.5, 3),
        (0, 7, -END, END),
    ],
)
def test_sines_and_rising_functions_are_sharp(low, high, least, most):
    """From the monotone pieces of the sine; and ±1 where they are reached."""
    is_tight(intervals.sin_cos(between(low, high))[0], np.sin(least), np.sin(most))
    quarter = between(low - np.pi / 2, high - np.pi / 2)
    is_tight(intervals.sin_cos(quarter)[1], np.sin(least), np.sin(most))
    for name, function in (("exp", np.exp), ("atan", np.arctan)):
        is_tight(intervals.monotone(name, between(low, high)), function(low), function(high))


def test_what_is_no_number_is_no_bound():
    widened = intervals.outward(np.array([[np.nan, 1.0], [np.nan, 2.0]]))
    assert widened[:, 0].tolist() == [-np.inf, np.inf]
    assert widened[0, 1] < 1.0
    assert widened[1, 1] > 2.0


def test_doubles_are_not_rounded():
    """An array with one end has numbers near to the exact ones."""
    x = np.array([[0.1, -3.0]])
    np.testing.assert_array_equal(intervals.outward(x), x)
    np.testing.assert_array_equal(intervals.product(x, x), x * x)


def test_a_sum_of_sixty_products_is_still_between_its_bounds():
    """Summed to nearest, without more slack: the slack of each product is for that."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        a, b = rng.normal(size=(2, 60)) * 10.0 ** rng.integers(-3, 3, size=(2, 60))
        products = intervals.product(np.stack([a, a]), np.stack([b, b]))
        exact = sum(Fraction(x) * Fraction(y) for x, y in zip(a, b, strict=True))
        low, high = products.sum(axis=1)
        assert Fraction(float(low)) <= exact <= Fraction(float(high))
