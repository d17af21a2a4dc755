"""Legs of inputs over time: which of them acts at a time, and where the next one begins."""

import numpy as np
import pytest

from rbstab.elements.inputs import legs
from rbstab.systems.schedule import BEGIN, leg_at, schedule_of


@pytest.fixture
def schedule():
    """Return the schedule of a pulse from 0.5 s to 1.5 s, and of a ramp from 0.25 s to 0.5 s."""
    return schedule_of({"pulse": legs.pulse(0.5, 1.0), "ramp": legs.ramp(0.25, 0.25)})


def test_a_new_leg_acts_from_its_breakpoint_on(schedule):
    def levels_and_slopes(time):
        return schedule.legs_at(time)[:, :BEGIN].tolist()

    assert schedule.breakpoints.tolist() == [0.25, 0.5, 1.5]
    assert levels_and_slopes(0.1) == [[0, 0], [0, 0]]
    assert levels_and_slopes(0.25) == [[0, 0], [0, 4]]
    assert levels_and_slopes(np.nextafter(0.5, 0)) == [[0, 0], [0, 4]]
    assert levels_and_slopes(0.5) == [[1, 0], [1, 0]]
    assert levels_and_slopes(1.5) == levels_and_slopes(9.0) == [[0, 0], [1, 0]]


def test_a_new_leg_of_one_signal_acts_from_its_breakpoint_on():
    pulse = legs.pulse(0.5, 1.0)
    assert leg_at(pulse, np.nextafter(0.5, 0)).tolist() == [0, 0, 0]
    assert leg_at(pulse, 0.5).tolist() == [1, 0, 0.5]


def test_breakpoints_between_two_times_leave_out_both(schedule):
    assert schedule.between(0.0, 2.0) == [0.25, 0.5, 1.5]
    assert schedule.between(0.25, 1.5) == [0.5]
    assert schedule.between(0.5, 1.5) == []
