"""The modes that belong to a state, for every kind of number of a state."""

import numpy as np
import pytest
from support.switching import data, guard, ligament, problem

from rbstab.analysis.exact import balls, exact_system, in_balls
from rbstab.systems.modes import (
    guard_rates,
    guards_at,
    modes_of,
    with_first_modes,
    with_modes,
    with_modes_at,
)

ELEMENTS = {"a": ligament(-1.0), "soft": guard("stiff", 40.0)}


@pytest.fixture
def system():
    return problem(data(ELEMENTS)).system


def state(x=0.0, angle=0.0, speed=0.0, spin=0.0):
    y = np.zeros(12)
    y[[6, 1, 9, 4]] = x, angle, speed, spin
    return y


CASES = [
    (state(), (0, 0, 0, 0)),
    (state(x=0.35), (1, 0, 0, 0)),
    (state(x=0.45), (1, 1, 0, 0)),
    (state(x=0.45, angle=0.4), (1, 1, 1, 0)),
    (state(x=-0.2, angle=-0.4), (0, 0, 0, 1)),
]


@pytest.mark.parametrize(("y", "expected"), CASES)
def test_modes_are_those_of_the_state(system, y, expected):
    for before in ((0.0,) * 4, (1.0,) * 4):
        assert modes_of(with_modes_at(with_modes(system, before), y)) == expected
        assert modes_of(with_first_modes(with_modes(system, before), y)) == expected


@pytest.mark.parametrize(("y", "expected"), CASES)
def test_modes_of_complex_numbers_and_of_balls(system, y, expected):
    """A complex step must not change them."""
    assert modes_of(with_modes_at(system, y + 1e-200j)) == expected
    in_modes = in_balls(lambda: with_modes_at(exact_system(system), balls(y)))
    assert modes_of(in_modes) == expected


@pytest.mark.parametrize(("speed", "expected"), [(1.0, 1.0), (-1.0, 0.0), (0.0, 0.0)])
def test_on_a_threshold_the_rate_decides_where_a_motion_begins(system, speed, expected):
    y = state(x=0.3, angle=0.3, speed=speed, spin=speed)
    assert guards_at(system, y)[[0, 2]].tolist() == [0, 0]
    assert modes_of(with_first_modes(system, y)) == (expected, 0, expected, 0)
    assert modes_of(with_modes_at(system, y)) == (0, 0, 0, 0)


def test_rates_of_the_event_functions(system):
    y = state(x=0.31, angle=0.2, speed=0.7, spin=1.9)
    # ℓ₀ is 1 m and ℓ = 1.01 m: both functions of the ligament are half of ℓ² plus a constant.
    expected = [1.01 * 0.7, 1.01 * 0.7, 1.9, -1.9]
    np.testing.assert_allclose(guard_rates(system, y), expected, atol=1e-14)
