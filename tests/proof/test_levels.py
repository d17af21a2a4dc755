"""Bounds of V over boxes contain V in balls of 300 bits; least values of known functions."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.balls import contains, reduced
from support.expressions import boxes

from rbstab.proof.boxes import Boxes
from rbstab.proof.enclosures.levels import Ranges, least_values, quadratic_range
from rbstab.proof.exact.expr import variable
from rbstab.proof.model import Energy

FINITE = st.floats(-10, 10, allow_nan=False)


def numbers(count):
    """Return a strategy of lists of numbers."""
    return st.lists(FINITE, min_size=count, max_size=count)


@settings(deadline=None, max_examples=60)
@given(numbers(3), numbers(9), numbers(3))
def test_a_quadratic_function_is_between_its_bounds(a, A, u):
    """Exactly, in rational numbers, at a point and at all corners."""
    symmetric = np.array(A).reshape(3, 3) + np.array(A).reshape(3, 3).T
    bounds = quadratic_range(np.array(a)[:, None], symmetric[:, :, None])
    points = [[max(-1.0, min(1.0, x)) for x in u], [0.0] * 3]
    points += [list(np.array(corner) * 2.0 - 1) for corner in np.ndindex(2, 2, 2)]
    points.append(bounds.u[:, 0].tolist())
    for point in points:
        x, b = [Fraction(v) for v in point], [Fraction(v) for v in a]
        M = [[Fraction(v) for v in row] for row in symmetric.tolist()]
        value = sum((b[i] * x[i] for i in range(3)), Fraction(0))
        pairs = [(i, j) for i in range(3) for j in range(3)]
        value += sum((M[i][j] * x[i] * x[j] for i, j in pairs), Fraction(0)) / 2
        assert Fraction(bounds.low[0]) <= value <= Fraction(bounds.high[0])


def pendulum(k=0, m=1):
    """Return m(1 - cos θ2) + ½ k θ2² + ½ (θ1² + θ3²), with coupling."""
    x, y, z = (variable(i) for i in range(3))
    half = Fraction(1, 2)
    U = m * (1 - y.cos()) + half * k * y * y + half * (x * x + z * z) + half * x.sin() * y.sin()
    return Energy(U)


JUMP = variable(1).sin() - Fraction(1, 4)
OFFSET = variable(3) - variable(1).sin()
KINDS = {
    "smooth": Energy(pendulum().U),
    "a force that jumps": Energy(JUMP * (2 * JUMP.step(1) - 1) + variable(0) ** 2),  # |h| + θ1²
    "a free variable": Energy(
        3 * OFFSET * OFFSET + Fraction(1, 4) * variable(3) ** 4 - variable(1).cos(), free=(3,)
    ),
}


@pytest.mark.parametrize("kind", KINDS)
@settings(deadline=None, max_examples=30)
@given(boxes(reach=0.5))
def test_v_is_between_its_bounds(kind, box):
    """With |θ2| < π/2; across the place of a jump the sides are told apart."""
    (lo, hi, point), energy = box, KINDS[kind]
    ranges = Ranges.of(energy)
    assert bool(ranges.sides) == (kind == "a force that jumps")
    if ranges.sides:
        lo, hi, point = (x + np.eye(3)[1] * (np.arcsin(0.25) - point[1]) for x in (lo, hi, point))
    over = ranges.values(Boxes(lo[:, None], hi[:, None]))
    for x in (lo, hi, point):
        try:
            V, *_ = reduced(energy.U, dict(enumerate(x.tolist())), range(3), energy.free)
        except ValueError:  # a step whose side is not known
            continue
        assert contains(over, 0, V)


def test_bounds_near_a_jump_are_as_sharp_as_those_of_its_sides():
    """Written out, the terms of the step do not cancel over a box; the sides have none."""
    y = variable(1)
    h = y.sin() * 100 - 25
    energy = Energy(h * (2 * h.step(1) - 1))
    x = np.array([0.0, np.arcsin(0.25), 0.0])[:, None]
    boxes = Boxes(x - 1e-6, x + 1e-6)
    over = Ranges.of(energy).values(boxes)
    assert over.hi[0] - over.lo[0] < 1e-3


def test_the_least_value_of_a_face():
    """At θ2 = π/2 of a pendulum with m = 3: 3 + ½ x² + ½ sin x is least where x = -½ cos x."""
    x = -0.45
    for _ in range(60):
        x -= (x + 0.5 * np.cos(x)) / (1 - 0.5 * np.sin(x))
    lo = np.array([-np.pi, np.pi / 2, -np.pi])
    hi = np.array([np.pi, np.nextafter(np.pi / 2, 2), np.pi])
    least = least_values(Ranges.of(pendulum(m=3)), Boxes(lo[:, None], hi[:, None]))
    exact = 3 + 0.5 * x * x + 0.5 * np.sin(x)
    assert least.bound[0] <= exact <= least.value[0] + 1e-12
    assert least.value[0] == pytest.approx(exact, rel=1e-12)
    assert least.bound[0] == pytest.approx(exact, abs=1e-7)
    assert least.at[0, 0] == pytest.approx(x, abs=1e-6)


def test_a_search_at_its_limit_has_a_weaker_bound_that_holds():
    """One box is not enough."""
    lo, hi = -np.full((3, 1), 2.0), np.full((3, 1), 2.0)
    least = least_values(Ranges.of(pendulum()), Boxes(lo, hi), limit=1)
    assert least.bound[0] < -0.1
    assert least.value[0] >= 0.0
