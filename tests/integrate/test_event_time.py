"""Protects the times of events within a step: zeros of event functions, located to round-off."""

import math

import pytest

from rbstab.integrate.event_time import OF_RANGE, OF_SWITCHES, event_time, zero_between

TOLERANCES = pytest.mark.parametrize("tolerance", [OF_SWITCHES, OF_RANGE])


@TOLERANCES
@pytest.mark.parametrize(
    ("value", "ends", "zero"),
    [
        (lambda t: t * t - 2.0, (1.0, 2.0), math.sqrt(2.0)),
        (lambda t: 0.5 - math.cos(t), (0.0, 3.0), math.pi / 3.0),
        (lambda t: math.exp(t) - 10.0, (2.0, 3.0), math.log(10.0)),
    ],
)
def test_a_zero_is_located_to_round_off(value, ends, zero, tolerance):
    """The error of each value, divided by its slope at the zero, is less than ulp(2)."""
    before, after = ends
    for locate in (zero_between, event_time):
        found = locate(value, before, after, tolerance)
        assert abs(found - zero) <= 4 * math.ulp(2.0)


def test_it_may_be_falling():
    assert abs(zero_between(lambda t: 2.0 - t * t, 1.0, 2.0) - math.sqrt(2.0)) <= math.ulp(2.0)


@TOLERANCES
def test_an_event_that_has_happened_is_at_the_start(tolerance):
    """A projection can put the start of a step past the event: then no sign changes."""
    assert event_time(lambda t: t - 0.5, 1.0, 2.0, tolerance) == 1.0
    assert event_time(lambda t: t - 1.0, 1.0, 2.0, tolerance) == 1.0


def test_an_event_at_the_end_is_located():
    assert event_time(lambda t: t - 2.0, 1.0, 2.0) == 2.0


def test_no_event_is_an_error():
    with pytest.raises(ValueError, match="sign"):
        zero_between(lambda t: t + 1.0, 1.0, 2.0)


def test_a_zero_near_the_time_zero_is_located_within_the_absolute_tolerance():
    zero = 3e-16
    assert abs(zero_between(lambda t: t - zero, 0.0, 1.0) - zero) <= OF_SWITCHES.absolute
