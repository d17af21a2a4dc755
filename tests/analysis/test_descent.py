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


def test_a_descent_that_would_leave_the_range_has_not_arrived():
    """Nor has one from numbers that are none; neither stops the others."""
    starts = np.array([[0.1, np.nan, -0.5], [0.0, 0.0, 0.0]])
    q, _, converged = descend(
        double_well(np.zeros(3)), starts, np.full(3, 1e-10), is_inside=lambda q: ~(q[0] >= 0.5)
    )
    assert converged.tolist() == [False, False, True]
    assert q[0, 0] < 0.5
    np.testing.assert_allclose(q[:, 2], [-1, 0], atol=1e-9)
