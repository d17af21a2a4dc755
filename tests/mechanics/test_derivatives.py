"""Complex steps give derivatives exact to round-off."""

import numpy as np
from support.differences import relative_error

from rbstab.mechanics.derivatives import jacobian


def test_jacobian_of_products_and_sines(rng):
    x, y, z = point = rng.normal(size=3)

    def function(p):
        return np.array([p[0] * p[1], np.sin(p[2]), p[0] / p[2], p[1] ** 3])

    expected = [[y, x, 0], [0, 0, np.cos(z)], [1 / z, 0, -x / z**2], [0, 3 * y**2, 0]]
    assert relative_error(jacobian(function, point), expected) < 1e-15


def test_nothing_is_subtracted(rng):
    # The value is 1e30 times the slope: a difference of floats would lose the slope.
    slope = jacobian(lambda p: 1e30 + np.sin(p[0]), np.array([0.7]))
    np.testing.assert_allclose(slope, [np.cos(0.7)], rtol=1e-15)
