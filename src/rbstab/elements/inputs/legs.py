"""The legs of signals that are not smooth at all times: pulses, ramps, tables and noise.

Each function returns the legs of a signal, shape (legs, 3): the level a, the slope b and the
beginning t_k of each `Leg`, in their order. The first leg is also the signal before its beginning.
All numbers but seeds may be complex, for derivatives (`mechanics.derivatives`): their real parts
tell which legs there are.
"""

import math
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array, Number


def pulse(start: Number, duration: Number) -> Array:
    """Return the legs of a signal that is 1 for a while, and 0 before and after it.

    Args:
        start: When it becomes 1, s.
        duration: For how long it is 1, s.
    """
    return np.array([[0.0, 0.0, 0.0], [1.0, 0.0, start], [0.0, 0.0, start + duration]])


def ramp(start: Number, duration: Number) -> Array:
    """Return the legs of a signal that rises from 0 to 1, and stays there.

    Args:
        start: When it begins to rise, s.
        duration: How long it rises, s.
    """
    return np.array([[0.0, 0.0, 0.0], [0.0, 1.0 / duration, start], [1.0, 0.0, start + duration]])


def table(times: Array, values: Array) -> Array:
    """Return the legs of straight lines between given values.

    Before the first time the signal is the first value, after the last time the last one. At a time
    that is given twice it jumps from one value to the next.

    Args:
        times: Shape (n,), s, ascending.
        values: Shape (n,).
    """
    lengths = np.diff(times)
    lines = np.flatnonzero(lengths.real > 0)
    slopes = np.diff(values)[lines] / lengths[lines]
    before, last = [values[0], 0.0, times[0]], [values[-1], 0.0, times[-1]]
    return np.array([before, *zip(values[lines], slopes, times[lines], strict=True), last])


def noise(seed: int, rate: Number, correlation_time: Number, duration: float) -> Array:
    """Return the legs of an Ornstein-Uhlenbeck process at equally spaced times.

    x has the mean 0, the standard deviation 1 and the correlation e^(-|τ|/T) between two of these
    times, from t = 0 on. With ρ = e^(-h/T) for times h apart, x_{k+1} = ρ x_k + √(1 - ρ²) ξ_k is
    this process without an error of discretisation; ξ_k are independent normal numbers. Between the
    times the signal is a straight line.

    Args:
        seed: From 0; equal seeds give equal numbers, also for other durations.
        rate: 1/h, 1/s.
        correlation_time: T, s.
        duration: Up to when the signal is needed, s.

    Source: D. T. Gillespie, Phys. Rev. E 54 (1996) 2084-2091, for the update.
    """
    knots = knot_count(rate, duration)
    xi = normal_numbers(seed, knots)
    steps = rate * correlation_time
    # Both agree but for the last digit, and the noise of a seed must never change.
    functions: Any = np if isinstance(steps, complex) else math
    keep = functions.exp(-1.0 / steps)
    fresh = functions.sqrt(-functions.expm1(-2.0 / steps))
    x = [xi[0]]
    for normal in xi[1:]:
        x.append(keep * x[-1] + fresh * normal)
    return table(np.arange(knots) / rate, np.array(x))


def knot_count(rate: Number, duration: float) -> int:
    """Return the number of times, 1/rate apart, that cover a duration from t = 0 on."""
    return math.ceil(rate.real * duration) + 1


def normal_numbers(seed: int, count: int) -> Array:
    """Return normal numbers with mean 0 and variance 1.

    Only the bits of numpy's generator are used: numpy may change how it makes normal numbers of
    them, and a seed must give the same motion for ever.
    """
    # Imported late: few runs need it.
    from scipy.special import ndtri

    bits = np.random.PCG64(seed).random_raw(count)
    uniform = ((bits >> np.uint64(12)) + 0.5) * 2.0**-52
    return np.asarray(ndtri(uniform))
