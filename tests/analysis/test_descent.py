"""Protects the descent in energy: downwards from any start, to a point without slope."""

from typing import NamedTuple

import numpy as np

from rbstab.analysis.descents.descent import descend
from rbstab.mechanics.numbers import Array


class At(NamedTuple):
    """Values with their derivatives."""

    value: Array
    gradient: Array
    hessian: Array


def double_well(heights):
    """Return x⁴/4 - x²/2 + h x + y²/2, with a slope h by problem."""

    def at(rows, q):
        (x, y), h = q, heights[rows]
        hessian = np.zeros((len(rows), 2, 2))
        hessian[:, 0, 0], hessian[:, 1, 1] = 3 * x**2 - 1, 1
        slope = np.stack([x**3 - x + h, y], axis=1)
        return At(x**4 / 4 - x**2 / 2 + h * x + y**2 / 2, slope, hessian)

    return at


def test_each_start_ends_in_its_own_valley():
    starts = np.array([[0.1, -0.1, 3.0, -5.0], [1.0, 2.0, -3.0, 0.0]])
    energy = double_well(np.zeros(4))
    q, value, converged = descend(energy, starts, np.full(4, 1e-10))
    assert converged.all()
    np.testing.assert_allclose(q[0], [1, -1, 1, -1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(value, -0.25, rtol=1e-12)


def test_the_energy_never_rises():
    """Also where the curvature is negative, and a plain Newton step would lead uphill."""
    rng = np.random.default_rng(0)
    starts, heights = rng.normal(size=(2, 200)), rng.uniform(-0.3, 0.3, 200)
    energy = double_well(heights)
    q, value, converged = descend(energy, starts, np.full(200, 1e-10))
    assert converged.all()
    assert np.all(value <= energy(np.arange(200), starts).value + 1e-12)
    # Every end is a minimum: the slope is zero and the curvature is positive.
    assert np.all(3 * q[0] ** 2 > 1)
    np.testing.assert_allclose(q[0] ** 3 - q[0] + heights, 0, atol=1e-9)


def narrow_valley(rows, q):
    """Return √(w² + x²) with w = 0.01; full steps jump over the valley again and again."""
    (x,), w = q, 0.01
    size = np.sqrt(w**2 + x**2)
    return At(size, (x / size)[:, np.newaxis], (w**2 / size**3)[:, np.newaxis, np.newaxis])


def test_a_step_that_would_climb_is_shortened():
    """From 0.3 the longest step leads to -0.2, and the next one back to 0.3."""
    starts = np.array([[0.3, -0.45, 2.0, 0.001]])
    q, value, converged = descend(narrow_valley, starts, np.full(4, 1e-8))
    assert converged.all()
    np.testing.assert_allclose(q, 0, atol=1e-9)
    np.testing.assert_allclose(value, 0.01, rtol=1e-12)


class CountedHessians:
    """Energies that count how often their Hessians are read."""

    def __init__(self, at, reads):
        self.value, self.gradient = at.value, at.gradient
        self._hessian, self._reads = at.hessian, reads

    @property
    def hessian(self):
        self._reads.append(len(self.value))
        return self._hessian


def test_a_hessian_is_only_read_for_another_step():
    energy, points = double_well(np.zeros(1)), []
    reads: list[int] = []

    def counted(rows, q):
        points.append(q)
        return CountedHessians(energy(rows, q), reads)

    _, _, converged = descend(counted, np.array([[0.9], [0.1]]), np.array([1e-10]))
    assert converged.all()
    # The descent ends at the last point, so only the points before it need a Hessian.
    assert len(reads) == len(points) - 1 > 2
    reads.clear()
    descend(counted, np.array([[1.0], [0.0]]), np.array([1e-10]))
    assert not reads


def test_a_start_without_slope_stays():
    q, value, converged = descend(double_well(np.zeros(1)), np.zeros((2, 1)), np.array([1e-10]))
    assert converged.all()
    assert np.array_equal(q, np.zeros((2, 1)))
    assert value[0] == 0


def test_a_descent_that_would_leave_the_range_has_not_arrived():
    starts = np.array([[0.1, -0.1], [0.0, 0.0]])
    q, _, converged = descend(
        double_well(np.zeros(2)), starts, np.full(2, 1e-10), is_inside=lambda q: q[0] < 0.5
    )
    assert converged.tolist() == [False, True]
    assert np.all(q[0] < 0.5)


def test_a_descent_that_is_late_ends_where_it_is():
    starts = np.array([[0.1], [0.0]])
    q, _, converged = descend(
        double_well(np.zeros(1)), starts, np.full(1, 1e-10), is_late=lambda: True
    )
    assert not converged[0]
    assert np.array_equal(q, starts)


def test_numbers_that_are_none_do_not_stop_the_others():
    starts = np.array([[np.nan, 0.5], [0.0, 0.0]])
    q, _, converged = descend(double_well(np.zeros(2)), starts, np.full(2, 1e-10))
    assert converged.tolist() == [False, True]
    np.testing.assert_allclose(q[:, 1], [1, 0], atol=1e-9)
