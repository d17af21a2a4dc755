"""A motion is trusted up to the sample where any number of two runs differs too much."""

from dataclasses import replace

import numpy as np
import pytest

from rbstab.integrate.problem import Trajectory
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching.trust import TRUST_TOLERANCE, trusted_until

TIMES = np.arange(6.0)

STATES = np.tile(np.repeat([1.0, 10.0, 0.1, 1e-12], 3), (6, 1))
"""Θ, Ω and E have the sizes 1, 10 and 0.1; F is round-off."""


def second_run(place=0, by=0.0, end=6, status=RunStatus.COMPLETED):
    """Return a run of which one number differs from t = 3 on."""
    states = STATES.copy()
    states[3:, place] += by
    nothing = np.zeros(end)
    return Trajectory(TIMES[:end], states[:end], nothing, nothing, status, "", 1, 1)


RUN = second_run()


@pytest.mark.parametrize(("place", "size"), [(0, 1.0), (2, 1.0), (4, 10.0), (7, 0.1)])
def test_trust_ends_before_any_number_differs_too_much(place, size):
    allowed = TRUST_TOLERANCE * size
    assert trusted_until(RUN, second_run(place, 0.9 * allowed)) == 5.0
    assert trusted_until(RUN, second_run(place, 1.1 * allowed)) == 2.0
    assert trusted_until(RUN, second_run(place, -1.1 * allowed)) == 2.0
    assert trusted_until(RUN, second_run(place, np.nan)) == 2.0


def in_quaternions(run):
    """Return the run with a quaternion of size 1 in the place of Θ."""
    return replace(run, states=np.column_stack([np.ones(len(run.times)), run.states]))


@pytest.mark.parametrize(("place", "size"), [(0, 1.0), (4, 10.0), (7, 0.1)])
def test_trust_ends_as_early_with_a_quaternion_in_place_of_angles(place, size):
    for factor, end in ((0.9, 5.0), (1.1, 2.0)):
        second = in_quaternions(second_run(place, factor * TRUST_TOLERANCE * size))
        assert trusted_until(in_quaternions(RUN), second, 13) == end


def test_round_off_is_no_difference():
    assert trusted_until(RUN, second_run(9, 1e-14)) == 5.0


def test_a_second_run_that_ends_early_ends_the_trust():
    assert trusted_until(RUN, second_run(end=4)) == 3.0
    late = second_run(end=4, status=RunStatus.TIME_LIMIT)
    assert np.isnan(trusted_until(RUN, late))
