"""Protects when a motion has settled: v is small, not negative, and the angles are at rest."""

from functools import partial

import numpy as np
import pytest

from rbstab.analysis.extrema import farthest_from_zero, sampled_steps
from rbstab.analysis.settling import moves_on, settling_times, value_round_off

TIMES = np.linspace(0, 20, 20001)
DECAY = 5.0 * np.exp(-TIMES)
NEAR = np.array([[0.09, -0.09, 0.0]])


ROUND_OFF = 1e-15


def settling(value, from_rest=NEAR, round_off=ROUND_OFF):
    return settled_at(TIMES, value, from_rest, supplied=False, round_off=round_off)


def settled_at(times, value, from_rest=NEAR, supplied=False, round_off=ROUND_OFF):
    """Return the settling time of one motion, whose steps are as short as the times are close."""
    steps = sampled_steps(times, value[np.newaxis])
    largest, noise = farthest_from_zero(steps).value[0], np.array([round_off])
    return settling_times(steps, 0, largest, np.asarray(from_rest), noise, supplied).time[0]


def test_v_has_to_stay_below_a_thousandth():
    assert settling(DECAY) == pytest.approx(np.log(1000), abs=1e-3)
    assert np.isnan(settling(np.where(TIMES > 19.99, 0.006, DECAY)))
    # Below zero it counts from a state that is not approached; round-off of v(0) is no reason.
    assert np.isnan(settling(DECAY - 0.004))
    assert settling(DECAY - 1e-8) == pytest.approx(np.log(1000), abs=1e-3)


@pytest.mark.parametrize("angle", [0.11, -0.11, np.nan])
def test_no_angle_may_be_far_from_rest(angle):
    """A small part of a large v(0) is much energy: the body may be far away still."""
    for far in np.where(np.eye(3), angle, NEAR):
        assert np.isnan(settling(DECAY, far[np.newaxis]))


def test_an_undamped_oscillation_moves_on():
    """v falls to 1 mJ, and half of that is kinetic on average; the same with damping comes to rest.

    With the rate 1/s of v, a tenth of 20 s takes e^-2 of it.
    """
    moving = 1e-3 * np.sin(7.0 * TIMES) ** 2
    assert moves_on(TIMES, DECAY + 1e-3, moving, ROUND_OFF)
    assert not moves_on(TIMES, DECAY, DECAY * np.sin(7.0 * TIMES) ** 2, ROUND_OFF)


def test_a_driven_motion_is_compared_with_its_largest_value():
    """v rises to 1 J at 1 s, and falls as exp(-(t - 1)): it has settled at 1 + ln 1000."""
    times = np.linspace(0.0, 20.0, 20_001)
    v = np.where(times < 1.0, times, np.exp(1.0 - times))
    assert np.isnan(settled_at(times, v))
    assert settled_at(times, v, supplied=True) == pytest.approx(1 + np.log(1000), abs=1e-3)
    falling = np.exp(-times)
    assert settled_at(times, falling, supplied=True) == settled_at(times, falling)


NOISE = 1e-17 * np.cos(1e3 * TIMES)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (-NOISE, 0.0),
        # It moves: v stays above round-off.
        (np.full(len(TIMES), 1e-14), np.nan),
        # It comes to rest where v is round-off, which may be above v(0)/1000.
        (1e-13 * np.exp(-TIMES) + NOISE, np.log(100)),
        (np.append(NOISE[1:], 1.0), np.nan),
    ],
)
def test_a_motion_whose_v_is_round_off_is_at_rest(value, expected):
    assert settling(value) == pytest.approx(expected, abs=1e-2, nan_ok=True)


def test_round_off_is_that_of_the_energies_and_of_the_forces():
    """A load of 100 N and a spring of 1e6 N/m: ½ (100 N)²/k = 5 mJ, but v is known to 100 N x eps.

    So a stiffer spring does not make v more accurate.
    """

    def energies(stiffness, x):
        return np.array([0.5 * stiffness * x[0] ** 2, -100.0 * x[0], 0.5 * x[1] ** 2])

    for stiffness in (1e4, 1e6, 1e8):
        rest = np.array([100.0 / stiffness, 0.0])
        round_off = value_round_off(partial(energies, stiffness), rest)
        assert 100.0 * np.finfo(float).eps < round_off < 1000.0 * np.finfo(float).eps
