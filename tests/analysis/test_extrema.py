"""Protects extrema and last crossings along steps, against closed solutions."""

import numpy as np
import pytest
from scipy.optimize import brentq

from rbstab.analysis.extrema import Steps, farthest_from_zero, last_above, sampled_steps

RATES = np.array([-3.0 + 40.0j, -1.0 + 7.0j, -5.0 + 0.5j])
"""Of three oscillations, 1/s."""


def oscillation(rate, order, t):
    """Return a derivative of e^(dt) sin(wt) cos(2wt), a product of exponentials."""
    fast, slow = complex(rate.real, 3 * rate.imag), complex(rate.real, -rate.imag)
    return 0.5 * sum((z**order * np.exp(z * t)).imag for z in (fast, slow))


def steps_of(times, function=oscillation, rates=RATES, parts=8):
    """Return the steps between some times of m members, shape (m, n), with equal quantities."""
    members = [part_of(line, function, rates, parts) for line in np.atleast_2d(times)]
    sizes = np.array([len(part.begin) for part in members])
    first = np.cumsum(sizes) - sizes

    def derivatives(quantity, step):
        values = np.empty((2, 2, len(step)))
        for number, part in enumerate(members):
            of = (step >= first[number]) & (step < first[number] + sizes[number])
            values[..., of] = part.derivatives(quantity[of], step[of] - first[number])
        return values

    def divide(step):
        member = int(np.searchsorted(first, step, side="right")) - 1
        return members[member].divide(step - first[member])

    return Steps(
        first,
        np.concatenate([part.begin for part in members]),
        np.concatenate([part.length for part in members]),
        np.concatenate([part.table for part in members], axis=-1),
        derivatives,
        divide,
    )


def part_of(times, function, rates, parts):
    table = np.array(
        [
            [[function(rate, order, t) for rate in rates] for order in range(4)]
            for t in (times[:-1], times[1:])
        ]
    )

    def derivatives(quantity, step):
        return table[:, 2:, quantity, step]

    def divide(step):
        if not parts:
            return None
        finer = np.linspace(times[step], times[step + 1], parts + 1)
        return part_of(finer, function, rates, 0)

    return Steps(np.zeros(1, int), times[:-1], np.diff(times), table[:, :2], derivatives, divide)


def true_extremum(rate, end):
    """Return the value of an oscillation farthest from zero, and its time, from fine samples."""
    t = np.linspace(0.0, end, 100_001)
    best = int(np.abs(oscillation(rate, 0, t)).argmax())
    if best in (0, len(t) - 1):
        return oscillation(rate, 0, t[best]), t[best]
    time = brentq(lambda x: oscillation(rate, 1, x), t[best - 1], t[best + 1], xtol=1e-15)
    return oscillation(rate, 0, time), time


@pytest.mark.parametrize("count", [20, 47, 150, 1000])
def test_extrema_are_those_of_the_closed_solution_within_their_errors(count):
    extrema = farthest_from_zero(steps_of(np.linspace(0.0, 2.0, count + 1)))
    for row, rate in enumerate(RATES):
        value, time = true_extremum(rate, 2.0)
        assert abs(extrema.value[row, 0] - value) <= extrema.error[row, 0] + 1e-14
        assert extrema.error[row, 0] <= 1e-5 * abs(value)
        assert extrema.time[row, 0] == pytest.approx(time, abs=1e-5)
    if count >= 1000:
        assert extrema.error.max() < 1e-8


def test_an_error_is_large_where_steps_are_too_long():
    """With 8 steps for 27 turns of the fastest one, and no shorter steps."""
    steps = steps_of(np.linspace(0.0, 2.0, 9), parts=0)
    extremum = farthest_from_zero(steps)
    value, _ = true_extremum(RATES[0], 2.0)
    assert extremum.error[0, 0] > 1e-2 * abs(value)


@pytest.mark.parametrize("shift", [0.0, 0.013, 0.021])
def test_two_turning_points_in_one_step_are_found(shift):
    """The rates at both ends have one sign; between them the quantity is five times as large."""

    def cubic(_, order, t):
        x = np.polynomial.Polynomial([0.2, 1.0, -9.0, 9.0]).deriv(order)
        return x(t + shift)

    times = np.array([-0.3, 0.0, 1.0])
    extremum = farthest_from_zero(steps_of(times, cubic, [0.0], parts=0))
    turns = np.polynomial.Polynomial([0.2, 1.0, -9.0, 9.0]).deriv().roots()
    t = np.array([*(turns - shift), *times])
    best = np.abs(cubic(0, 0, t[(t >= -0.3) & (t <= 1.0)])).max()
    assert abs(extremum.value[0, 0]) == pytest.approx(best, rel=1e-12)
    # From below, the level lies between the two turns: only the second part is above it.
    inside = cubic(0, 0, turns[0] - shift) - 1e-3
    steps = steps_of(np.array([0.0, 0.55]), cubic, [0.0], parts=0)
    crossing = last_above(steps, 0, np.array([inside]))
    assert cubic(0, 0, crossing.time[0]) == pytest.approx(inside, abs=1e-12)
    assert crossing.time[0] > turns[0] - shift


@pytest.mark.parametrize("count", [150, 300, 1000])
@pytest.mark.parametrize("level", [0.3, 0.02, 1e-3])
def test_last_crossings_are_those_of_the_closed_solution(count, level):
    steps = steps_of(np.linspace(0.0, 4.0, count + 1))
    t = np.linspace(0.0, 4.0, 400_001)
    for row, rate in enumerate(RATES):
        above = np.flatnonzero(oscillation(rate, 0, t) >= level)
        crossing = last_above(steps, row, np.array([level]))
        if not len(above):
            assert crossing.time[0] == 0.0
        elif above[-1] == len(t) - 1:
            assert np.isnan(crossing.time[0])
        else:
            last = above[-1]
            true = brentq(lambda x, r=rate: oscillation(r, 0, x) - level, t[last], t[last + 1])
            assert abs(crossing.time[0] - true) <= crossing.error[0] + 1e-11
            assert crossing.error[0] <= 1e-5 * true


def test_levels_beside_a_maximum_are_decided():
    """One is 1e-9 above a late maximum of the quantity, and one is as much below it."""
    rate = RATES[1]
    t = np.linspace(2.0, 4.0, 100_001)
    v = oscillation(rate, 0, t)
    tops = np.flatnonzero((v[1:-1] > v[:-2]) & (v[1:-1] > v[2:])) + 1
    top = tops[v[tops] > v[tops].max() * 0.5][-1]
    time = brentq(lambda x: oscillation(rate, 1, x), t[top - 1], t[top + 1], xtol=1e-15)
    height = oscillation(rate, 0, time)
    steps = steps_of(np.linspace(0.0, 4.0, 152))
    above, below = (last_above(steps, 1, np.array([height + x])).time[0] for x in (1e-9, -1e-9))
    assert above < time - 0.1
    assert below == pytest.approx(time, abs=1e-4)


def test_a_step_of_no_length_is_a_jump():
    """A quantity falls from 1 to 0.2 at t = 1, as v does in an impact, and then to 0.1."""
    times = np.array([0.0, 1.0, 1.0, 2.0])
    steps = sampled_steps(times, np.array([[1.0, 1.0, 0.2, 0.1]]))
    assert np.array(last_above(steps, 0, np.array([0.5]))).tolist() == [[1.0], [0.0]]
    extrema = farthest_from_zero(steps)
    assert extrema.value.item() == 1.0
    assert extrema.time.item() == 0.0


def test_what_is_always_above_or_below_has_no_crossing():
    steps = steps_of(np.linspace(0.0, 1.0, 50))
    assert last_above(steps, 0, np.array([2.0])).time.tolist() == [0.0]
    assert np.isnan(last_above(steps, 0, np.array([-2.0])).time[0])


def test_members_do_not_depend_on_each_other():
    """To the last bit: a member has its own steps, and some of them are divided."""
    ends = np.linspace(0.8, 2.0, 7)
    lines = np.linspace(0.0, ends, 31, axis=1)
    level = np.full(len(ends), 0.05)
    extrema, crossing = (
        f(steps_of(lines)) for f in (farthest_from_zero, lambda s: last_above(s, 0, level))
    )
    for member, line in enumerate(lines):
        alone = steps_of(line)
        for part, whole in zip(farthest_from_zero(alone), extrema, strict=True):
            assert part[:, 0].tobytes() == whole[:, member].tobytes()
        for part, whole in zip(last_above(alone, 0, level[:1]), crossing, strict=True):
            assert part.tobytes() == whole[member : member + 1].tobytes()


def test_round_off_has_no_extremum_between_ends():
    """Its largest end is taken, whatever the signs of its rates."""
    noise = 1e-13 * np.random.default_rng(0).normal(size=(1, 50))
    extremum = farthest_from_zero(sampled_steps(np.linspace(0.0, 1.0, 50), noise))
    assert abs(extremum.value.item()) == np.abs(noise).max()
