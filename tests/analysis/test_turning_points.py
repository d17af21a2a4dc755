"""Protects the interpolation of turning points through more samples, and its estimated errors."""

import numpy as np
import pytest

from rbstab.analysis.turning_points import through_more_samples, turning_points

TIMES = np.linspace(0.0, 2.0, 41)
PHASES = np.linspace(0.0, 6.0, 25)[:, np.newaxis]


def found_in(values, rates):
    """Return the turning points of signals whose rates change their sign, before and after."""
    lowest = np.full(len(values), 1e-9)
    indices = np.abs(values).argmax(axis=1)
    before = turning_points(TIMES, values, rates, lowest, indices)
    return before, through_more_samples(TIMES, values, rates, before)


@pytest.mark.parametrize("frequency", [6.0, 24.0])
def test_a_sine_turns_at_one_within_the_estimated_error(frequency):
    values = np.sin(frequency * TIMES + PHASES)
    rates = frequency * np.cos(frequency * TIMES + PHASES)
    before, after = found_in(values, rates)
    turns = np.isfinite(before.error)
    assert turns.sum() > 50
    errors = np.abs(np.abs(after.value) - 1.0)[turns]
    assert (errors <= after.error[turns] + 1e-13).all()
    # Degree 11 instead of 7: the estimated errors are much smaller.
    assert np.median(after.error[turns]) < 0.2 * np.median(before.error[turns])


@pytest.mark.parametrize("strength", [0.3, -2.0, 3.0])
@pytest.mark.parametrize("shift", np.linspace(-0.14, 0.14, 8))
def test_a_corner_near_a_turn_has_an_error_of_its_size(shift, strength):
    """Beside a corner no degree is accurate: the estimate must not be too small."""
    kink = 1.0 + shift
    phase = 10.0 * TIMES - 10.0 + np.pi / 2
    beyond = np.maximum(TIMES - kink, 0.0)
    values = (np.sin(phase) + strength * beyond)[np.newaxis]
    rates = (10.0 * np.cos(phase) + strength * (kink < TIMES))[np.newaxis]
    _, after = found_in(values, rates)
    near = np.isfinite(after.error) & (np.abs(after.time - 1.0) < 0.06)
    dense = np.linspace(0.95, 1.05, 200_001)
    exact = np.sin(10.0 * dense - 10.0 + np.pi / 2) + strength * np.maximum(dense - kink, 0.0)
    errors = np.abs(after.value[near] - exact.max())
    assert (errors <= after.error[near] + 1e-9).all()
