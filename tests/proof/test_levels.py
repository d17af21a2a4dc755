"""Bounds of V over boxes contain V in balls of 300 bits; least values of known functions."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st

from rbstab.proof.boxes import Boxes
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.enclosures.levels import Ranges, least_values, quadratic_range
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.model import Energy

FINITE = st.floats(-10, 10, allow_nan=False)
PLACES = st.floats(0, 1)


def numbers(count):
    """Return a strategy of lists of numbers."""
    return st.lists(FINITE, min_size=count, max_size=count)


@settings(deadline=None, max_examples=150)
@given(numbers(3), numbers(9), numbers(3))
def test_a_quadratic_function_is_between_its_bounds(a, A, u):
    """Exactly, in rational numbers, at a point and at all corners."""
    symmetric = np.array(A).reshape(3, 3) + np.array(A).reshape(3, 3).T
    found = quadratic_range(np.array(a)[:, None], symmetric[:, :, None])
    points = [[max(-1.0, min(1.0, x)) for x in u], [0.0] * 3]
    points += [list(np.array(corner) * 2.0 - 1) for corner in np.ndindex(2, 2, 2)]
    points.append(found.u[:, 0].tolist())
    for point in points:
        x, b = [Fraction(v) for v in point], [Fraction(v) for v in a]
        M = [[Fraction(v) for v in row] for row in symmetric.tolist()]
        value = sum((b[i] * x[i] for i in range(3)), Fraction(0))
        pairs = [(i, j) for i in range(3) for j in range(3)]
        value += sum((M[i][j] * x[i] * x[j] for i, j in pairs), Fraction(0)) / 2
        assert Fraction(found.low[0]) <= value <= Fraction(found.high[0])


def test_a_convex_quadratic_function_is_bounded_sharply():
    """Its least value is a'u/2 inside, and at a corner where it falls all along."""
    A = np.array([[2.0, 0.5, 0.0], [0.5, 1.0, 0.2], [0.0, 0.2, 3.0]])
    inside = np.array([0.3, -0.2, 0.4])
    a = np.stack([-A @ inside, np.array([-9.0, -9.0, -9.0])], axis=1)
    found = quadratic_range(a, np.repeat(A[:, :, None], 2, axis=2))
    least = [-0.5 * inside @ A @ inside, -27 + 0.5 * A.sum()]
    np.testing.assert_allclose(found.low, least, rtol=1e-10)


def pendulum(k=0, m=1):
    """Return m(1 - cos θ2) + ½ k θ2² + ½ (θ1² + θ3²), with coupling."""
    x, y, z = (variable(i) for i in range(3))
    half = Fraction(1, 2)
    U = m * (1 - y.cos()) + half * k * y * y + half * (x * x + z * z) + half * x.sin() * y.sin()
    return Energy(U)


def in_balls(x, m=1, k=0):
    """Return the same at a point, in balls of 300 bits."""
    a, b, c = (arb(v) for v in x)
    spring = (a * a + c * c + k * b * b) / 2
    return m * (1 - b.cos()) + spring + a.sin() * b.sin() / 2


@settings(deadline=None, max_examples=60)
@given(
    numbers(3),
    st.lists(st.floats(1e-9, 2), min_size=3, max_size=3),
    st.lists(PLACES, min_size=3, max_size=3),
)
def test_v_is_between_its_bounds(centre, width, place):
    """At points of boxes of all sizes."""
    lo = np.array(centre)
    hi = lo + np.array(width)
    lo[1], hi[1] = lo[1] / 10 - 0.5, min(lo[1] / 10 - 0.5 + width[1], 1.57)  # cos θ2 >= 0
    over = Ranges.of(pendulum()).values(Boxes(lo[:, None], hi[:, None]))
    points = [lo, hi, np.clip(lo + np.array(place) * (hi - lo), lo, hi)]
    with ctx.workprec(300):
        for x in points:
            value = in_balls(x)
            assert arb(over.lo[0]) <= value <= arb(over.hi[0])


@settings(deadline=None, max_examples=40)
@given(numbers(3), st.floats(1e-6, 0.5), st.lists(PLACES, min_size=3, max_size=3))
def test_v_is_between_its_bounds_where_a_force_jumps(centre, width, place):
    """|h| with h = sin θ2 - 1/4, written with a step: h (2 step(h) - 1)."""
    y = variable(1)
    h = y.sin() - Fraction(1, 4)
    ranges = Ranges.of(Energy(h * (2 * h.step(1) - 1) + variable(0) * variable(0)))
    assert ranges.sides
    lo = np.array(centre) / 10
    lo[1] = np.arcsin(0.25) - width * place[0]
    hi = lo + width
    over = ranges.values(Boxes(lo[:, None], hi[:, None]))
    with ctx.workprec(300):
        for x in (lo, hi, np.clip(lo + np.array(place) * width, lo, hi)):
            value = abs(arb(x[1]).sin() - arb(1) / 4) + arb(x[0]) ** 2
            assert arb(over.lo[0]) <= value <= arb(over.hi[0])


def test_bounds_near_a_jump_are_as_sharp_as_those_of_its_sides():
    """Written out, the terms of the step do not cancel over a box; the sides have none."""
    y = variable(1)
    h = y.sin() * 100 - 25
    energy = Energy(h * (2 * h.step(1) - 1))
    x = np.array([0.0, np.arcsin(0.25), 0.0])[:, None]
    boxes = Boxes(x - 1e-6, x + 1e-6)
    over = Ranges.of(energy).values(boxes)
    assert over.hi[0] - over.lo[0] < 1e-3


@settings(deadline=None, max_examples=25)
@given(st.floats(0.2, 3.0), st.floats(-1, 1), st.floats(0.01, 0.5))
def test_v_least_over_other_variables_is_between_its_bounds(stiffness, at, width):
    """min over z of ½ c(θ) (z - sin θ)² + z⁴/4 - cos θ, against points: an upper bound."""
    c = Fraction(stiffness)
    y, z = variable(1), variable(3)
    free = z - y.sin()
    U = c * free * free * Fraction(1, 2) + Fraction(1, 4) * z * z * z * z - y.cos()
    lo, hi = np.array([0.0, at, 0.0])[:, None], np.array([0.1, at + width, 0.1])[:, None]
    over = Ranges.of(Energy(U, free=(3,))).values(Boxes(lo, hi))
    for theta in np.linspace(at, at + width, 7):
        root = [
            r.real
            for r in np.roots([1, 0, stiffness, -stiffness * np.sin(theta)])
            if abs(r.imag) < 1e-9
        ]
        value = min(0.5 * stiffness * (r - np.sin(theta)) ** 2 + r**4 / 4 for r in root) - np.cos(
            theta
        )
        assert over.lo[0] <= value + 1e-12
        assert value - 1e-12 <= over.hi[0]


def test_the_least_value_of_a_face():
    """At θ2 = π/2 of a pendulum with m = 3: 3 + ½ x² + ½ sin x is least where x = -½ cos x."""
    x = -0.45
    for _ in range(60):
        x -= (x + 0.5 * np.cos(x)) / (1 - 0.5 * np.sin(x))
    lo = np.array([-np.pi, np.pi / 2, -np.pi])
    hi = np.array([np.pi, np.nextafter(np.pi / 2, 2), np.pi])
    found = least_values(Ranges.of(pendulum(m=3)), Boxes(lo[:, None], hi[:, None]))
    exact = 3 + 0.5 * x * x + 0.5 * np.sin(x)
    assert found.closed[0]
    assert found.bound[0] <= exact <= found.value[0] + 1e-12
    assert found.value[0] == pytest.approx(exact, rel=1e-12)
    assert found.bound[0] == pytest.approx(exact, abs=1e-7)
    assert found.at[0, 0] == pytest.approx(x, abs=1e-6)


def test_a_search_at_its_limit_has_a_weaker_bound_that_holds():
    """One box is not enough."""
    lo, hi = -np.full((3, 1), 2.0), np.full((3, 1), 2.0)
    found = least_values(Ranges.of(pendulum()), Boxes(lo, hi), limit=1)
    assert not found.closed[0]
    assert found.bound[0] <= 0.0 <= found.value[0]


def test_an_energy_without_a_jump_has_no_sides():
    """Nor has one with more jumps than are tried."""
    y = variable(1)
    many = expr(0)
    for k in range(5):
        h = y - Fraction(k, 10)
        many = many + h * h.step(1)
    assert not Ranges.of(pendulum()).sides
    assert not Ranges(BoundedEnergy(many)).sides
    assert not Ranges.of(Energy(many)).sides
