"""Central differences of eighth order, and the relative error of an answer."""

import numpy as np

FIRST = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
SECOND = (8 / 5, -1 / 5, 8 / 315, -1 / 560)
CENTRE = -205 / 72


def derivative(function, step=5e-3):
    """Return df/dt at t = 0.

    The error is the larger of (ωh)⁸/630 for a motion of ω rad/s and 1e-16/h. At the default step
    and the tests' ω of about 10 rad/s both are below 1e-12.
    """
    pairs = [
        weight * (function(k * step) - function(-k * step)) for k, weight in enumerate(FIRST, 1)
    ]
    return sum(pairs) / step


def second_derivative(function, step=5e-3):
    """Return d²f/dt² at t = 0, to about 1e-11."""
    pairs = [
        weight * (function(k * step) + function(-k * step)) for k, weight in enumerate(SECOND, 1)
    ]
    return (sum(pairs) + CENTRE * function(0.0)) / step**2


def along(function, y, rates, step=1e-2):
    """Return d/dt of a function of the state along a flow with the given rates ẏ."""
    # The default step keeps every entry within 0.04 of y, even in a stiff flow.
    return derivative(lambda t: function(y + t * rates), step / np.abs(rates).max())


def jacobian(function, x, step=1e-2):
    """Return ∂f/∂x, shape (*f, n)."""
    columns = [
        derivative(lambda t, direction=direction: function(x + t * direction), step)
        for direction in np.eye(len(x))
    ]
    return np.stack(columns, axis=-1)


def hessian(function, x, step=1e-4):
    """Return ∂²f/∂x², shape (n, n), by differences of second order."""
    h = step * np.eye(len(x))
    rows = [
        [
            function(x + a + b) - function(x + a - b) - function(x - a + b) + function(x - a - b)
            for b in h
        ]
        for a in h
    ]
    return np.array(rows) / (4 * step**2)


def relative_error(actual, expected, scale=None):
    """Return the largest difference over the largest expected entry, or over a given scale."""
    actual, expected = np.asarray(actual), np.asarray(expected)
    assert actual.shape == expected.shape
    return np.abs(actual - expected).max() / (np.abs(expected).max() if scale is None else scale)
