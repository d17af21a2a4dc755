"""Extremes of a sampled quantity between its samples."""

import numpy as np

from rbstab.mechanics.numbers import Array


def signed_peak(times: Array, values: Array, rates: Array) -> float:
    """The value farthest from zero of the cubics through values and rates of neighbouring samples.

    The samples alone miss a peak by half their distance; the cubic Hermite interpolant has an error
    of h⁴/384 times the fourth derivative.

    Args:
        times: Shape (n,), s, ascending.
        values: Shape (n,).
        rates: The derivatives of the values, shape (n,), 1/s times their unit.

    Returns:
        The value with its sign; NaN where a value is NaN.
    """
    candidates = np.concatenate([values, _turning_values(np.diff(times), values, rates)])
    return float(candidates[np.abs(candidates).argmax()])


def _turning_values(h: Array, values: Array, rates: Array) -> Array:
    """The values where the cubics p(s), s from 0 to 1, turn inside their intervals."""
    start, end = values[:-1], values[1:]
    linear, last = h * rates[:-1], h * rates[1:]
    quadratic = 3 * (end - start) - 2 * linear - last
    cubic = 2 * (start - end) + linear + last
    with np.errstate(all="ignore"):
        # Roots of p' = linear + 2 quadratic s + 3 cubic s², in the form that does not cancel.
        root = np.sqrt(quadratic**2 - 3 * cubic * linear)
        q = -(quadratic + np.copysign(root, quadratic))
        s = np.concatenate([q / (3 * cubic), linear / q])
        inside = (s > 0) & (s < 1)
        a, b, c, d = (np.tile(x, 2) for x in (start, linear, quadratic, cubic))
        turning = a + s * (b + s * (c + s * d))
    return turning[inside]
