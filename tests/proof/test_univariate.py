"""Taylor coefficients of functions of one number, against series of 300 bits."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb_series, ctx
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support.balls import BITS, ball, contains

from rbstab.proof.enclosures.intervals import Intervals
from rbstab.proof.enclosures.univariate import coefficients
from rbstab.proof.exact.expr import COS, SIN

ENDS = st.floats(-20, 20) | st.sampled_from([0.0, 0.5, -0.5, 1.0, np.inf, -np.inf])
NAMES = {SIN: None, COS: None, "exp": None, "sqrt": 0, "log": 0, "atan": None}
EXAMPLES = [
    pytest.param(20, id="some"),
    pytest.param(400, id="many", marks=pytest.mark.heavy),
]


@st.composite
def places(draw):
    """Return an interval and a double in it."""
    low, high = sorted((draw(ENDS), draw(ENDS)))
    least, most = max(low, -1e3) + 0.0, min(high, 1e3) + 0.0  # -0 becomes 0
    assume(least <= most)
    x = draw(st.floats(least, most) | st.sampled_from([least, most]))
    return low, high, x


def exact(kind, extra, x):
    """Return g, g', g''/2 and g'''/6 at a double."""
    with ctx.workprec(BITS):
        at = arb_series([ball(x), 1], 4)
        if kind != "power":
            found = getattr(at, kind)()
        else:
            found = arb_series([1], 4)
            for _ in range(abs(extra)):
                found = found * at if extra > 0 else found / at
        return [found[k] for k in range(4)]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("count", EXAMPLES)
@pytest.mark.parametrize(
    ("kind", "extra"),
    [*((name, None) for name in NAMES), *(("power", n) for n in (-3, -1, 2, 3, 5))],
)
def test_coefficients_over_an_interval_contain_those_inside(kind, extra, count):
    @settings(deadline=None, max_examples=count, derandomize=count < 100)
    @given(places())
    def test(place):
        low, high, x = place
        above = kind in {"log", "sqrt"}
        assume(x > 1e-100 or not above)
        assume(abs(x) > 1e-100 or extra is None or extra > 0)
        found = coefficients(kind, extra, Intervals(np.array([low]), np.array([high])), 3)
        assert len(found) == 4
        for one, value in zip(found, exact(kind, extra, x), strict=True):
            assert contains(one, 0, value), (one.lo, one.hi, value)

    test()


@pytest.mark.parametrize("kind", [*NAMES, "power"])
def test_at_a_point_they_are_those_numbers(kind):
    """To some ulps, also of (3x² - 1) d³/3 of the arc tangent, which is zero at 1/√3."""
    for x in (0.3, 1.0, 3**-0.5, 2.5):
        extra = -2 if kind == "power" else None
        one = np.array([x])
        for found, value in zip(
            coefficients(kind, extra, Intervals(one, one), 3), exact(kind, extra, x), strict=True
        ):
            assert contains(found, 0, value)
            assert found.hi[0] - found.lo[0] < 1e-12 * max(1.0, abs(float(value)))


def test_a_known_least_value_bounds_the_cosine_alone():
    """The cosine of an angle in ±π/2, of which only its interval in doubles is known."""
    x = Intervals(np.array([1.5]), np.array([1.7]))
    free, known = (coefficients(COS, None, x, 3, least) for least in (None, 0.0))
    assert free[0].lo[0] < 0.0 == known[0].lo[0]
    assert known[0].hi[0] == free[0].hi[0]
    assert (known[1].lo[0], known[1].hi[0]) == (free[1].lo[0], free[1].hi[0])
    assert known[2].hi[0] < 1e-299  # -½ cos
    assert free[2].hi[0] > 0.05
    beyond = Intervals(np.array([1.6]), np.array([1.7]))
    (clamped, *_) = coefficients(COS, None, beyond, 3, 0.0)
    assert clamped.lo[0] == clamped.hi[0] == 0.0


def test_a_root_has_no_slope_at_zero():
    found = coefficients("sqrt", None, Intervals(np.array([0.0]), np.array([4.0])), 3)
    assert found[0].lo[0] == 0.0
    assert all(one.lo[0] == -np.inf and one.hi[0] == np.inf for one in found[1:])


def test_a_zero_factor_ends_the_powers():
    """x² has no third coefficient, exactly."""
    x = Intervals(np.array([-np.inf]), np.array([2.0]))
    found = coefficients("power", 2, x, 3)
    assert (found[3].lo[0], found[3].hi[0]) == (0.0, 0.0)
    assert Fraction(found[2].lo[0]) <= 1 <= Fraction(found[2].hi[0])


def test_other_functions_are_refused():
    one = np.ones(1)
    with pytest.raises(ValueError, match="gamma"):
        coefficients("gamma", None, Intervals(one, one), 2)
