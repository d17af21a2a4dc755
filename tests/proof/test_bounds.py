"""Bounds of V and its derivatives over boxes contain those in balls of 300 bits."""

from fractions import Fraction

import numpy as np
import pytest
from flint import ctx
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from support.balls import BITS, ball, contains, gradient, reduced, value
from support.expressions import RATIONAL, affine, boxes, convex, energies, outlined

from rbstab.proof.enclosures.bounds import BoundedEnergy, Matrices, inverses, preconditioned
from rbstab.proof.enclosures.intervals import Intervals
from rbstab.proof.exact.expr import COS, INNER, OF, atom, expr, only, variable

NUMBERS = (0, 1, 2)
SOON = [
    pytest.param(15, id="some"),
    pytest.param(120, id="many", marks=pytest.mark.heavy),
]


def fuzz(test, *strategies, count):
    """Run a test for so many examples."""
    quiet = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large]
    with np.errstate(all="ignore"):
        settings(
            deadline=None, max_examples=count, derandomize=count < 100, suppress_health_check=quiet
        )(given(*strategies)(test))()


def inside(M: Matrices, i, j, exact):
    """Whether an entry of a matrix is within its radius; an entry without a bound is."""
    mid, rad = float(M.mid[i, j, 0]), float(M.rad[i, j, 0])
    if not (np.isfinite(mid) and np.isfinite(rad)):
        return True
    with ctx.workprec(BITS):
        return not abs(exact - ball(mid)) > ball(rad) + ball(2) ** -200


def check(U, lo, hi, point, *, free=(), order=3, least=None):
    """Compare all bounds over a box with what is known at its middle, and at a point."""
    n = len(lo)
    numbers = NUMBERS[:n]
    energy = BoundedEnergy(U, numbers, free, least=least, order=order)
    b = energy.over(lo[:, None], hi[:, None])
    try:
        V, g, H = reduced(U, dict(enumerate(point.tolist())), numbers, free)
        centre = dict(enumerate(b.centre[:, 0].tolist()))
        V0, g0, _ = reduced(U, centre, numbers, free)
    except ValueError:  # a step whose side is not known, or no minimum
        assume(False)
        raise
    assert contains(b.value_over, 0, V)
    assert contains(b.value, 0, V0)
    for i in range(n):
        assert contains(b.gradient, (i, 0), g0[i])
        assert contains(b.gradient_over, (i, 0), g[i])
        assert contains(b.slopes, (i, 0), g[i])
        assert all(inside(b.hessian, i, j, H[i][j]) for j in range(n))
        assert meets(b, i, point, g[i])
    _check_operator(b, point, g)
    return b


def meets(b, i, point, exact):
    """Whether ∇V(x) is in ∇V(m) + S(x - m), with x itself."""
    with ctx.workprec(BITS):
        low, high = ball(float(b.gradient.lo[i, 0])), ball(float(b.gradient.hi[i, 0]))
        for j in range(len(point)):
            d = ball(float(point[j])) - ball(float(b.centre[j, 0]))
            mid, rad = float(b.slope.mid[i, j, 0]), float(b.slope.rad[i, j, 0])
            if not (np.isfinite(mid) and np.isfinite(rad)):
                return True
            low += ball(mid) * d - ball(rad) * abs(d)
            high += ball(mid) * d + ball(rad) * abs(d)
        tiny = ball(2) ** -200
        return not (exact < low - tiny or exact > high + tiny)


def _check_operator(b, point, g):
    """Compare Y∇V(x) with step + (I ± R)(x - m)."""
    step, error, mean, _ = preconditioned(b)
    Y = inverses(b.slope.mid)[:, :, 0]
    if not (np.all(np.isfinite(Y)) and np.all(np.isfinite(mean))):
        return
    with ctx.workprec(BITS):
        d = [ball(float(x)) - ball(float(c)) for x, c in zip(point, b.centre[:, 0], strict=True)]
        for i in range(len(point)):
            exact = sum(ball(float(Y[i, j])) * g[j] for j in range(len(point)))
            reach = sum(ball(float(mean[i, j, 0])) * abs(d[j]) for j in range(len(point)))
            reach += ball(float(error[i, 0])) + ball(2) ** -200
            assert not abs(exact - ball(float(step[i, 0])) - d[i]) > reach


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("count", SOON)
def test_an_energy_is_between_its_bounds(order, count):
    def test(U, box):
        lo, hi, point = box
        check(U, lo, hi, point, order=order)

    fuzz(test, energies(), boxes(), count=count)


@pytest.mark.parametrize("count", SOON)
def test_an_outlined_function_is_between_its_bounds(count):
    def test(F, U, box, factor):
        lo, hi, point = box
        check(F * factor + U, lo, hi, point)

    fuzz(test, outlined(), energies(), boxes(), RATIONAL.filter(bool), count=count)


@pytest.mark.parametrize("free", [1, 2])
@pytest.mark.parametrize("count", [pytest.param(6, id="some"), *SOON[1:]])
def test_the_least_energy_is_between_its_bounds(free, count):
    """U = f(Θ) + ½ |z - g(Θ)|² and convex terms of z; its minimum is found in 300 bits."""
    z = [variable(3 + k) for k in range(free)]

    def test(f, slopes, box, kinds):
        g, more, h = slopes
        total = f
        for k, kind in enumerate(kinds[:free]):
            total = total + convex(g.sin() + k, z[k], Fraction(1, 2), 0)
            total = total + convex(more, z[k], Fraction(k + 1, 3), kind)
        if free == 2:
            total = total + convex(h.cos(), z[0] + z[1], Fraction(1, 4), kinds[2])
        lo, hi, point = box
        check(total, lo, hi, point, free=(3, 4)[:free])

    kinds = st.lists(st.integers(0, 4), min_size=3, max_size=3)
    slopes = st.tuples(affine(), affine(), affine())
    fuzz(test, energies(), slopes, boxes(), kinds, count=count)


def test_the_least_energy_of_a_quadratic_is_as_sharp_as_its_closed_form():
    """min over z of ½ z² - z sin θ1 is -½ sin² θ1; the rest is ½ (θ2² + θ3²)."""
    x, y, w, z = (variable(k) for k in range(4))
    half = Fraction(1, 2)
    U = half * z * z - z * x.sin() + half * (y * y + w * w)
    closed = half * (y * y + w * w) - half * x.sin() ** 2
    for size in (0.0, 1e-6, 1e-3, 0.1):
        lo = np.array([0.4, -0.2, 0.3])
        b = check(U, lo, lo + size, lo + size / 3, free=(3,))
        c = check(closed, lo, lo + size, lo + size / 3)
        assert np.all(b.hessian.rad <= 6 * c.hessian.rad + 1e-9)
        assert b.value.hi[0] - b.value.lo[0] < 1e-12
        np.testing.assert_allclose(b.gradient.mid, c.gradient.mid, atol=1e-14)


@pytest.mark.parametrize(("factor", "end"), [(1, 2.0), (2, 1.0), (4, 0.5), (50, 2.0)])
def test_a_box_too_wide_for_one_minimiser_has_no_bounds(factor, end):
    """U = ½ z² + 4 (1 + (z - cθ1)²)^½ is convex, but Krawczyk's test fails as z moves with θ1."""
    x, z = variable(0), variable(3)
    U = Fraction(1, 2) * z * z + 4 * (1 + (z - factor * x) ** 2).sqrt()
    lo, hi = np.array([[-end]]), np.array([[end]])
    b = BoundedEnergy(U, (0,), (3,)).over(lo, hi)
    assert (b.value_over.lo[0], b.value_over.hi[0]) == (-np.inf, np.inf)
    assert (b.gradient_over.lo[0, 0], b.gradient_over.hi[0, 0]) == (-np.inf, np.inf)
    assert not np.isfinite(b.hessian.rad[0, 0, 0])
    # A smaller box has them.
    near = BoundedEnergy(U, (0,), (3,)).over(lo / 100, hi / 100)
    assert np.isfinite(near.hessian.rad[0, 0, 0])


def test_bounds_shrink_with_the_third_power_of_a_box():
    """Of ∇V by Taylor's theorem: its linear part is exact, the error falls by 100."""
    U = (variable(0) * variable(1)).sin() + variable(2).exp()
    errors = []
    for size in (1e-2, 1e-3):
        lo = np.array([0.5, 0.4, 0.3])
        b = check(U, lo, lo + size, lo + 0.3 * size)
        errors.append(float((b.slope.rad[:, :, 0] @ b.radius[:, 0]).max()))
    assert errors[1] < errors[0] / 80


def test_the_known_least_cosine_is_applied():
    """1/cos θ2 over a box that ends at the double above π/2: bounded below, not above."""
    cosine = variable(1).cos()
    lo, hi = np.array([0.0, 1.5, 0.0]), np.array([0.1, np.nextafter(np.pi / 2, 2), 0.1])
    least = {atom(COS, variable(1)): 0.0}
    plain, known = (
        BoundedEnergy(1 / cosine, least=one).over(lo[:, None], hi[:, None]) for one in ({}, least)
    )
    assert plain.value_over.lo[0] == -np.inf
    assert known.value_over.lo[0] == pytest.approx(1 / np.cos(1.5), rel=1e-9)
    assert known.value_over.hi[0] == np.inf
    # d/dθ2 1/cos θ2 = sin/cos², which is least at the lower end.
    assert known.gradient_over.lo[1, 0] == pytest.approx(np.sin(1.5) / np.cos(1.5) ** 2, rel=1e-6)
    check(1 / cosine, lo, np.array([0.1, 1.57, 0.1]), np.array([0.0, 1.56, 0.1]), least=least)


ENDLESS = {
    "a line": (variable(0) * 2 - variable(1), (2.0, -1.0, 0.0)),
    "atan": (variable(0).atan(), None),
    "step": (variable(0).step(2) * variable(0) ** 2, None),
    "jump": (variable(0).step(1) * variable(0), None),
}


@pytest.mark.parametrize("name", ENDLESS)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_box_without_ends_gives_bounds_or_none(name):
    U, slopes = ENDLESS[name]
    lo = np.array([[-np.inf], [-1.0], [0.0]])
    for hi in (np.array([[np.inf], [1.0], [1.0]]), np.array([[3.0], [1.0], [1.0]])):
        b = BoundedEnergy(U).over(lo, hi)
        for x in (-1e6, -2.0, 2.5):
            point = {0: x, 1: 0.5, 2: 0.25}
            assert contains(b.value_over, 0, value(U, point))
            for i, g in enumerate(gradient(U, point, NUMBERS)):
                assert contains(b.gradient_over, (i, 0), g)
        if slopes is not None:
            np.testing.assert_allclose(b.gradient_over.mid[:, 0], slopes, atol=1e-14)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_an_outlined_function_over_a_line_without_ends_is_bounded_or_not():
    """F(y) = step(y - 1) (y - 1)² exp(1 - y) is between 0 and 4/e²."""
    y = variable(INNER) - 1
    for order, F in ((2, y.step(2) * y**2 * (-y).exp()), (1, y.step(1) * y.atan())):
        U = only(atom(OF, variable(0) * 2 + variable(1), F))
        for low, high in ((-np.inf, np.inf), (-np.inf, 3.0), (0.0, np.inf), (5.0, np.inf)):
            lo, hi = np.array([[low], [0.0]]), np.array([[high], [0.5]])
            b = BoundedEnergy(U, (0, 1)).over(lo, hi)
            for x in (-7.0, 0.6, 2.0, 5.5, 40.0):
                if low <= x <= high:
                    point = {0: x, 1: 0.25}
                    assert contains(b.value_over, 0, value(U, point)), (order, low, high, x)
                    for i, g in enumerate(gradient(U, point, (0, 1))):
                        assert contains(b.gradient_over, (i, 0), g)


def test_the_least_eigenvalue_at_a_point_is_that_of_the_closed_form():
    """V, ∇V and ∇²V of `at` are those of the balls, to round-off."""
    x, y, z = variable(0), variable(1), variable(3)
    U = (x * y).sin() + Fraction(1, 2) * z * z + z * x + (1 + z * z).sqrt()
    energy = BoundedEnergy(U, (0, 1), (3,))
    point = np.array([0.7, -0.4])
    V, g, H = energy.at(point[:, None])
    exact = reduced(U, dict(enumerate(point.tolist())), (0, 1), (3,))
    assert V[0] == pytest.approx(float(exact[0]), abs=1e-14)
    np.testing.assert_allclose(g[:, 0], [float(v) for v in exact[1]], atol=1e-13)
    hessian = np.array([[float(v) for v in row] for row in exact[2]])
    np.testing.assert_allclose(H[:, :, 0], hessian, atol=1e-13)
    np.testing.assert_allclose(energy.curvatures(point), np.linalg.eigvalsh(hessian), atol=1e-13)
    np.testing.assert_allclose(energy.minimiser(point[:, None]).C[0, :, 0][1], 0, atol=1e-15)


def test_a_singular_matrix_among_others_spoils_only_itself():
    M = np.stack([np.diag([2.0, 4.0]), np.zeros((2, 2))], axis=2)
    found = inverses(M)
    np.testing.assert_array_equal(found[:, :, 0], np.diag([0.5, 0.25]))
    assert np.all(np.isnan(found[:, :, 1]))


def test_slopes_use_the_better_of_both_bounds():
    """From the terms near a pole, and by the mean value theorem in a small box."""
    U = (variable(0) - variable(1)) * (variable(0) + variable(1)) + expr(0)
    lo, hi = np.array([[0.0], [0.0], [0.0]]), np.array([[1.0], [1.0], [1.0]])
    b = BoundedEnergy(U).over(lo, hi)
    assert isinstance(b.slopes, Intervals)
    np.testing.assert_allclose(b.slopes.lo[:, 0], [0, -2, 0], atol=1e-11)
    np.testing.assert_allclose(b.slopes.hi[:, 0], [2, 0, 0], atol=1e-11)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_derivative_that_jumps_is_not_known_from_the_centre(order):
    """x^k step(x) from -1 to 2: at the centre all derivatives are those of x^k, before 0 none."""
    x = variable(0)
    for U in (x.step(order) * x**order, (x - 1).step(order) * (x - 1) ** order + x.sin()):
        for place in (-1.0, -0.25, 0.25, 1.75):
            lo, hi = np.array([-1.0, 0.0, 0.0]), np.array([2.0, 1.0, 1.0])
            check(U, lo, hi, np.array([place, 0.5, 0.5]))


def test_arguments_of_functions_are_bounded_by_derivatives_over_the_box():
    """exp(2θ1) for |θ1| <= 2 is far above its Taylor polynomial at 0, which ends at 23.7 < 54.6."""
    U = ((2 * variable(0)).exp() + 1).sqrt() + ((2 * variable(0)).exp() + variable(1)).atan()
    end = np.array([2.0, 0.5, 0.5])
    for sign in (-1, 1):
        check(U, -end, end, sign * end)


@pytest.mark.parametrize("size", [0.02, 0.1, 0.2])
def test_what_the_minimum_takes_off_the_curvature_is_counted(size):
    """min over z of ½ z² - z θ1² is -½ θ1⁴: a third of its curvature -6 θ1² is that of U at z."""
    U = Fraction(1, 2) * variable(3) ** 2 - variable(3) * variable(0) ** 2
    end = np.array([size])
    b = check(U, -end, end, end, free=(3,))
    assert np.isfinite(b.hessian.rad[0, 0, 0])
