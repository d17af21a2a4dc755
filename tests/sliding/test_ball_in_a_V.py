"""Each axis of a held ball moves as the closed form of a ball in the potential K|x| - Gx."""

import numpy as np
import pytest
from support.problems import each_engine
from support.sliding import audit, ball_in_a_V, solve_sliding

M, K = 2.0, 30.0


def crossings(x, load, count):
    """Return when an undamped ball from rest at x > 0 crosses x = 0."""
    down, up = (K - load) / M, (K + load) / M
    fall = np.sqrt(2 * x / down)
    speed = down * fall
    times = [fall]
    while len(times) < count:
        flight = 2 * speed / (up if len(times) % 2 else down)
        times.append(times[-1] + flight)
    return np.array(times)


@each_engine
def test_every_axis_crosses_when_its_parabolas_say(engine):
    x, load = np.array([0.3, 0.2, 0.5]), np.array([0.0, 5.0, -10.0])
    times = np.linspace(0, 4.9, 11)
    run = solve_sliding(engine, ball_in_a_V(M, K, load, np.zeros(3), x, np.zeros(3), times))
    for axis in range(3):
        switch_times = run.switches.switch_times[run.switches.switch_axes == axis]
        expected = crossings(x[axis], load[axis], len(switch_times) + 1)
        assert len(switch_times) > 5
        assert switch_times == pytest.approx(expected[:-1], abs=1e-10)
        assert expected[-1] > 4.9
    # At each of 30 crossings the compiled flow moves the axis off by 1e-12 of its flight.
    assert audit(run) < 1e-10


@each_engine
def test_through_a_boundary_layer(engine):
    """From outside, a parabola leads to the layer, and a part of an oscillation through it."""
    width, x0 = 0.01, 0.05
    down = K / M
    entry = np.sqrt(2 * (x0 - width) / down)
    omega = np.sqrt(K / (M * width))
    speed = down * entry
    # Inside x = δ cos ωt - (speed/ω) sin ωt; by symmetry it leaves after twice the time to x = 0.
    zero = np.arctan2(width, speed / omega) / omega
    times = np.linspace(0, entry + 2 * zero + 1e-4, 2)
    problem = ball_in_a_V(
        M, K, np.zeros(3), np.zeros(3), np.full(3, x0), np.zeros(3), times, layer=width
    )
    run = solve_sliding(engine, problem)
    switch_times = run.switches.switch_times[run.switches.switch_axes == 1]
    assert switch_times == pytest.approx([entry, entry + 2 * zero], abs=1e-10)
    assert audit(run) < 1e-11
