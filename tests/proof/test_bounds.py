"""Bounds of V and its derivatives over boxes contain those in balls of 300 bits."""

from fractions import Fraction

import numpy as np
import pytest
from flint import ctx
from hypothesis import assume
from hypothesis import strategies as st
from support.balls import BITS, ball, contains, reduced
from support.expressions import COUNTS, RATIONAL, affine, boxes, convex, energies, fuzz, outlined

from rbstab.proof.enclosures.bounds import BoundedEnergy, inverses, preconditioned
from rbstab.proof.exact.atoms import COS, INNER, OF
from rbstab.proof.exact.expr import atom, only, variable

X, Y, Z, W = (variable(k) for k in range(4))
HALF = Fraction(1, 2)


def within(low, high, exact):
    with ctx.workprec(BITS):
        tiny = ball(2) ** -200
        return not (exact < low - tiny or exact > high + tiny)


def about(matrix, i, j):
    """Return an entry of a matrix as a ball; one without a bound may be any number."""
    mid, rad = float(matrix.mid[i, j, 0]), float(matrix.rad[i, j, 0])
    return ball(mid), ball(rad if np.isfinite([mid, rad]).all() else np.inf)


def check(U, lo, hi, point, *, free=(), order=3, least=None):
    """Compare all bounds over a box with what is known at its middle, and at a point."""
    n = len(lo)
    numbers = range(n)
    b = BoundedEnergy(U, numbers, free, least=least, order=order).over(lo[:, None], hi[:, None])
    centre = b.centre[:, 0]
    try:
        V, g, H = reduced(U, dict(enumerate(point.tolist())), numbers, free)
        V0, g0, _ = reduced(U, dict(enumerate(centre.tolist())), numbers, free)
    except ValueError:  # a step whose side is not known, or no minimum
        assume(False)
        raise
    assert contains(b.value_over, 0, V)
    assert contains(b.value, 0, V0)
    with ctx.workprec(BITS):
        away = [ball(float(x)) - ball(float(m)) for x, m in zip(point, centre, strict=True)]
        for i in range(n):
            assert contains(b.gradient, (i, 0), g0[i])
            assert contains(b.gradient_over, (i, 0), g[i])
            assert contains(b.slopes, (i, 0), g[i])
            low, high = ball(float(b.gradient.lo[i, 0])), ball(float(b.gradient.hi[i, 0]))
            for j in range(n):
                mid, rad = about(b.hessian, i, j)
                assert within(mid - rad, mid + rad, H[i][j])
                mid, rad = about(b.slope, i, j)
                low += mid * away[j] - rad * abs(away[j])
                high += mid * away[j] + rad * abs(away[j])
            assert within(low, high, g[i])  # ∇V(x) is in ∇V(m) + S(x - m)
        step, error, mean, _ = preconditioned(b)
        inverse = inverses(b.slope.mid)[:, :, 0]
        if np.isfinite(inverse).all() and np.isfinite(mean).all():
            for i in range(n):  # Y∇V(x) is in step + (I ± R)(x - m)
                exact = sum(ball(float(inverse[i, j])) * g[j] for j in range(n))
                reach = sum(ball(float(mean[i, j, 0])) * abs(away[j]) for j in range(n))
                reach += ball(float(error[i, 0]))
                exact -= ball(float(step[i, 0])) + away[i]
                assert within(-reach, reach, exact)
    return b


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("count", COUNTS)
def test_an_energy_is_between_its_bounds(order, count):
    """Also one with an outlined function."""

    def test(F, U, box, factor):
        check(F * factor + U, *box, order=order)

    fuzz(test, outlined(), energies(), boxes(), RATIONAL, count=count)


def test_a_sum_that_cancels_is_between_its_bounds():
    """Each term is rounded by far more than an ulp of the sum."""
    for k in range(20):
        x = np.array([1e8 + 0.1 * k, 1e8, 0.3 * k])
        check(X / 3 - Y / 3 + Z / 7, x, x, x)


@pytest.mark.parametrize("free", [1, 2])
@pytest.mark.parametrize("count", COUNTS)
def test_the_least_energy_is_between_its_bounds(free, count):
    """U = f(Θ) + ½ |z - g(Θ)|² and convex terms of z; its minimum is found in 300 bits."""
    z = [variable(3 + k) for k in range(free)]

    def test(f, slopes, box, kinds):
        g, more, h = slopes
        total = f
        for k, kind in enumerate(kinds[:free]):
            total = total + convex(g.sin() + k, z[k], HALF, 0)
            total = total + convex(more, z[k], Fraction(k + 1, 3), kind)
        if free == 2:
            total = total + convex(h.cos(), z[0] + z[1], Fraction(1, 4), kinds[2])
        check(total, *box, free=(3, 4)[:free])

    kinds = st.lists(st.integers(0, 4), min_size=3, max_size=3)
    slopes = st.tuples(affine(), affine(), affine())
    fuzz(test, energies(), slopes, boxes(), kinds, count=count // 2)


def test_the_least_energy_of_a_quadratic_is_as_sharp_as_its_closed_form():
    """min over z of ½ z² - z sin θ1 is -½ sin² θ1; the rest is ½ (θ2² + θ3²)."""
    rest = HALF * (Y * Y + Z * Z)
    for size in (0.0, 1e-3, 0.1):
        box = np.array([0.4, -0.2, 0.3]) + np.outer([0, 1, 1 / 3], [size] * 3)
        b = check(rest + HALF * W * W - W * X.sin(), *box, free=(3,))
        c = check(rest - HALF * X.sin() ** 2, *box)
        assert np.all(b.hessian.rad <= 6 * c.hessian.rad + 1e-9)
        assert b.value.hi[0] - b.value.lo[0] < 1e-12
        np.testing.assert_allclose(b.gradient.mid, c.gradient.mid, atol=1e-14)


@pytest.mark.parametrize(("factor", "end"), [(1, 2.0), (4, 0.5), (50, 2.0)])
def test_a_box_too_wide_for_one_minimiser_has_no_bounds(factor, end):
    """U = ½ z² + 4 (1 + (z - cθ1)²)^½ is convex, but Krawczyk's test fails as z moves with θ1."""
    U = HALF * W * W + 4 * (1 + (W - factor * X) ** 2).sqrt()
    hi = np.array([[end]])
    wide, near = (BoundedEnergy(U, (0,), (3,)).over(-corner, corner) for corner in (hi, hi / 100))
    assert (wide.value_over.lo[0], wide.value_over.hi[0]) == (-np.inf, np.inf)
    assert (wide.gradient_over.lo[0, 0], wide.gradient_over.hi[0, 0]) == (-np.inf, np.inf)
    assert not np.isfinite(wide.hessian.rad[0, 0, 0])
    assert np.isfinite(near.hessian.rad[0, 0, 0])


def test_the_known_least_cosine_is_applied():
    """1/cos θ2 over a box that ends at the double above π/2: bounded below, not above."""
    lo, hi = np.array([0.0, 1.5, 0.0]), np.array([0.1, np.nextafter(np.pi / 2, 2), 0.1])
    least = {atom(COS, Y): 0.0}
    plain, bounded = (
        BoundedEnergy(1 / Y.cos(), least=values).over(lo[:, None], hi[:, None])
        for values in ({}, least)
    )
    assert plain.value_over.lo[0] == -np.inf
    assert bounded.value_over.lo[0] == pytest.approx(1 / np.cos(1.5), rel=1e-9)
    assert bounded.value_over.hi[0] == np.inf
    # d/dθ2 1/cos θ2 = sin/cos², which is least at the lower end.
    assert bounded.gradient_over.lo[1, 0] == pytest.approx(np.sin(1.5) / np.cos(1.5) ** 2, rel=1e-6)
    check(1 / Y.cos(), lo, np.array([0.1, 1.57, 0.1]), np.array([0.0, 1.56, 0.1]), least=least)


INNER_1 = variable(INNER) - 1
ENDLESS = {
    "a line": X * 2 - Y,
    "atan": X.atan(),
    "a kink": X.step(2) * X**2,
    "a jump": X.step(1) * X,
    "an outlined function": only(
        atom(OF, X * 2 + Y, INNER_1.step(2) * INNER_1**2 * (-INNER_1).exp())
    ),
}


@pytest.mark.parametrize("name", ENDLESS)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_box_without_ends_gives_bounds_or_none(name):
    for low, high in ((-np.inf, np.inf), (-np.inf, 3.0), (0.0, np.inf)):
        lo, hi = np.array([[low], [-1.0], [0.0]]), np.array([[high], [1.0], [1.0]])
        b = BoundedEnergy(ENDLESS[name]).over(lo, hi)
        for x in (-1e6, -2.0, 2.5, 40.0):
            if low <= x <= high:
                V, g, _ = reduced(ENDLESS[name], {0: x, 1: 0.5, 2: 0.25}, range(3), ())
                assert contains(b.value_over, 0, V)
                assert all(contains(b.gradient_over, (i, 0), g[i]) for i in range(3))
        if name == "a line":
            np.testing.assert_allclose(b.gradient_over.mid[:, 0], [2, -1, 0], atol=1e-14)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_derivative_that_jumps_is_not_known_from_the_centre(order):
    """x^k step(x) from -1 to 2: at the centre all derivatives are those of x^k, before 0 none."""
    for U in (X.step(order) * X**order, (X - 1).step(order) * (X - 1) ** order + X.sin()):
        for place in (-1.0, -0.25, 0.25, 1.75):
            lo, hi = np.array([-1.0, 0.0, 0.0]), np.array([2.0, 1.0, 1.0])
            check(U, lo, hi, np.array([place, 0.5, 0.5]))


def test_arguments_of_functions_are_bounded_by_derivatives_over_the_box():
    """exp(2θ1) for |θ1| <= 2 is far above its Taylor polynomial at 0, which ends at 23.7 < 54.6."""
    U = ((2 * X).exp() + 1).sqrt() + ((2 * X).exp() + Y).atan()
    # Its third derivative is near that of its argument, which is least at the centre.
    nearly = 1000 * ((2 * X).exp() / 1000 + (-2 * X).exp() / 1000).exp()
    end = np.array([2.0, 0.5, 0.5])
    for sign in (-1, 1):
        check(U, -end, end, sign * end)
        check(nearly, -end / 4, end / 4, sign * end / 4)


def test_what_the_minimum_takes_off_the_curvature_is_counted():
    """min over z of ½ z² - z θ1² is -½ θ1⁴: a third of its curvature -6 θ1² is that of U at z."""
    for size in (0.02, 0.2):
        end = np.array([size])
        b = check(HALF * W**2 - W * X**2, -end, end, end, free=(3,))
        assert np.isfinite(b.hessian.rad[0, 0, 0])
