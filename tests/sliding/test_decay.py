"""The chatter on s = E decays as it should: |F| ~ exp(-dt/3), |E| ~ exp(-2dt/3)."""

import numpy as np
import pytest
from support.sliding import ball_in_a_V, solve_sliding

M, K, SPEED = 2.0, 3000.0, 1.0
RATES = np.array([0.3, 0.6, 1.2])
"""d of each axis, 1/s."""

PULL = K / M


@pytest.fixture(scope="module")
def ball():
    """Return a run of three balls in a V with different damping, through some 20,000 bounces."""
    times = np.linspace(0, 5, 11)
    X, V = np.full(3, 1e-9), SPEED * np.array([1.0, 1.1, 0.9])
    return solve_sliding("heyoka", ball_in_a_V(M, K, np.zeros(3), M * RATES, X, V, times))


def bounces(d, x, speed, duration):
    """Return the times at which ẍ = -k sgn x - dẋ crosses x = 0, flight by flight.

    A flight from x is x + (v + k/d)(1 - exp(-dτ))/d - kτ/d; Newton's method finds its root.
    """
    time, times = 0.0, list[float]()
    while True:
        flight = 2 * speed / PULL * (1 - d * speed / (3 * PULL)) + x / speed
        for _ in range(4):
            fallen = -np.expm1(-d * flight) / d
            height = x + (speed + PULL / d) * fallen - PULL * flight / d
            velocity = (speed + PULL / d) * np.exp(-d * flight) - PULL / d
            flight -= height / velocity
        time, x, speed = time + flight, 0.0, -velocity
        if time > duration:
            return np.array(times)
        times.append(time)


@pytest.mark.parametrize("axis", range(3))
def test_every_bounce_of_a_ball_is_in_closed_form(ball, axis):
    start = ball.states[0]
    expected = bounces(RATES[axis], start[6 + axis], start[9 + axis], ball.times[-1])
    switch_times = ball.switches.switch_times[ball.switches.switch_axes == axis]
    assert len(expected) == len(switch_times) > 4000
    # Each switch moves the axis off the surface by 1e-12 of its flight: n²/2 of that in n flights.
    assert switch_times[:100] == pytest.approx(expected[:100], abs=1e-11)
    assert switch_times == pytest.approx(expected, abs=1e-7)
