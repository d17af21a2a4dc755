"""A set of motions is followed until it is decided, halved or given up."""

from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import pytest
from flint import arb
from scipy.integrate import solve_ivp
from support.polynomial_sets import place_in_frame, state_of
from support.start_sets import random_config, random_set, together

from rbstab.analysis.motion_proof.motion import proof_precision
from rbstab.analysis.motion_proof.sets import set_motion
from rbstab.analysis.motion_proof.sets.equations import equations_of
from rbstab.analysis.motion_proof.sets.motion_set import MotionSet
from rbstab.analysis.motion_proof.sets.set_motion import (
    FIRST_STEP,
    MAX_STEPS,
    NARROWEST,
    Part,
    followed,
    whole,
)
from rbstab.analysis.motion_proof.sets.set_step import FOR_POINTS, FOR_SETS, SetSteps
from rbstab.experiment.convergence.enclosed_system import enclosed_system

NO_EQUATIONS: Any = None
"""Steps that are replaced need none."""


def any_set(**options):
    return random_set(random_config("permanent", "reduced", 5), 7, **options)


def steps_of(monkeypatch, lengths):
    """Replace the proof of steps of one set: each has a given length; None stands for no proof.

    The end of a step that is not proved has no meaning: here it is a set of NaN.
    """
    asked = []

    def step(equations, start, scale, longest, orders):
        asked.append(longest[0])
        h = lengths(len(asked), longest[0])
        if h is not None:
            return SetSteps(np.array([h]), start, np.array([True]))
        none = replace(start, radius=start.radius * np.nan, polynomial=start.polynomial * np.nan)
        return SetSteps(np.array([np.nan]), none, np.array([False]))

    monkeypatch.setattr(set_motion, "set_steps", step)
    return asked


def followed_alone(equations, states, scale, decide_one):
    """Follow one set; `decide_one` is given the set and its time."""

    def decide(now, times, numbers):
        assert (len(now), times.shape, numbers.tolist()) == (1, (1,), [0])
        return [decide_one(now, float(times[0]))]

    (found,) = followed(equations, states, scale, decide)
    return found


def undecided(states, times, numbers):
    return [None] * len(states)


def test_the_time_is_never_below_the_sum_of_all_steps(monkeypatch):
    """0.1 added ten times in doubles is below ten times that double."""
    states, scale = any_set()
    steps_of(monkeypatch, lambda *_: 0.1)
    times = []

    def decision(_, t):
        times.append(t)
        return "done" if len(times) == 400 else None

    found = followed_alone(NO_EQUATIONS, states, scale, decision)
    assert (found.steps, found.decision, found.variable) == (399, "done", None)
    assert found.time == times[-1]
    for count, t in enumerate(times):
        assert count * Fraction(0.1) <= Fraction(t) <= count * Fraction(0.1) * (1 + Fraction(1e-12))


def test_a_start_that_is_decided_needs_no_step(monkeypatch):
    states, scale = any_set()
    asked = steps_of(monkeypatch, lambda *_: None)
    found = followed_alone(NO_EQUATIONS, states, scale, lambda *_: "inside")
    assert (found.steps, found.time, found.decision, asked) == (0, 0.0, "inside", [])


def test_shorter_steps_are_tried_before_a_set_is_halved(monkeypatch):
    states, scale = any_set()
    asked = steps_of(monkeypatch, lambda *_: None)
    (found,) = followed(NO_EQUATIONS, states, scale, undecided)
    assert found.steps == 0
    assert found.decision is None
    assert found.variable == states.nonlinearity(scale)[0].argmax()
    assert asked[0] == FIRST_STEP
    assert asked[1:] == [x / 2 for x in asked[:-1]]
    assert len(asked) > 3


def test_a_set_with_a_large_error_is_halved(monkeypatch):
    states, scale = any_set(error=1.0)
    steps_of(monkeypatch, lambda *_: 0.001)
    for error, variable in ((0.1, True), (np.nan, True), (1e-4, False)):
        wide = replace(states, radius=np.full((1, 6), error))
        (found,) = followed(NO_EQUATIONS, wide, scale, undecided)
        assert (found.variable is not None) == variable
        assert found.steps == (0 if variable else MAX_STEPS)


def test_a_set_is_given_up_after_all_steps(monkeypatch):
    states, scale = any_set()
    asked = steps_of(monkeypatch, lambda _, longest: longest)
    (found,) = followed(NO_EQUATIONS, states, scale, undecided)
    assert (found.steps, found.decision, found.variable) == (MAX_STEPS, None, None)
    assert asked[1] == 1.5 * asked[0]


def test_all_motions_are_in_the_last_set():
    """The set that is decided is that of its time: motions in doubles are in it."""
    config = random_config("permanent", "reduced", 5)
    states, scale = random_set(config, 7, width=1e-3, error=1e-9)
    sets: list[MotionSet] = []

    def decision(now, t):
        sets.append(now)
        return t > 0.01 or None

    with proof_precision():
        equations = equations_of(partial(enclosed_system, config))
        found = followed_alone(equations, states, scale, decision)
    assert found.decision
    assert found.steps == len(sets) - 1 > 1
    system = enclosed_system(config, lambda values: values)
    for z in ([1.0, -1.0], [0.3, 0.9]):
        start = np.array([float(x) for x in state_of(states, z, np.zeros(6))])
        end = solve_ivp(
            lambda _, y: system.rates(y),
            (0, found.time),
            start,
            method="DOP853",
            rtol=1e-13,
            atol=1e-13,
        ).y[:, -1]
        place = place_in_frame(sets[-1], z, [arb(x) for x in end.tolist()])
        slack = np.abs(np.linalg.inv(sets[-1].frame[0])) @ (1e-11 * scale)
        assert np.all(np.abs(place) <= sets[-1].radius[0] + slack)
        assert np.all(sets[-1].error < 1e-6 * scale)


@pytest.mark.parametrize("variable", [0, 1])
def test_halves_of_a_part(variable):
    states, _ = any_set()
    part = whole(states)
    assert (part.low.tolist(), part.high.tolist()) == ([-1.0, -1.0], [1.0, 1.0])
    lower, upper = part.halves(variable)
    other = 1 - variable
    for one, (low, high) in ((lower, (-1.0, 0.0)), (upper, (0.0, 1.0))):
        assert (one.low[variable], one.high[variable]) == (low, high)
        assert (one.low[other], one.high[other]) == (-1.0, 1.0)
    # The states of a half are those of its z.
    z = np.array([0.5, 0.5])
    for one in (*lower.halves(other), *upper.halves(other)):
        inner = one.low + (one.high - one.low) * (z + 1) / 2
        y = state_of(states, inner.tolist(), np.zeros(6))
        assert np.all(np.abs(place_in_frame(one.start, z.tolist(), y)) <= one.start.radius[0])
    assert (part.low.tolist(), part.high.tolist()) == ([-1.0, -1.0], [1.0, 1.0])


def test_parts_that_may_be_halved_have_exact_halves():
    states, _ = any_set()
    part, count = whole(states), 0
    while part.can_be_halved(0):
        middle = (Fraction(part.low[0]) + Fraction(part.high[0])) / 2
        lower, upper = part.halves(0)
        assert Fraction(lower.high[0]) == Fraction(upper.low[0]) == middle
        # Towards 1/3, where each bound has all its digits.
        part, count = (lower if middle > Fraction(1, 3) else upper), count + 1
    assert part.high[0] - part.low[0] == NARROWEST
    assert count == 41
    assert isinstance(part, Part)
    assert part.can_be_halved(1)


def several_sets(orders):
    """Return a config, four sets whose motions are followed for different times, and the scale."""
    config = random_config("permanent", "reduced", 5)
    shape: dict[str, Any] = {} if orders is FOR_SETS else {"variables": 0, "degree": 0}
    sizes = [(1e-3, 1e-9), (0.2, 1e-6), (1e-4, 1e-12), (1e-2, 1e-2)]
    found = [
        random_set(config, 7 + k, width=width, error=error, **shape)
        for k, (width, error) in enumerate(sizes)
    ]
    sets, scale = [one for one, _ in found], found[0][1]
    for k, one in enumerate(sets):
        one.polynomial[:, 3:] *= 1 + 0.1 * k  # they turn faster, so that steps are shorter
    return config, sets, scale


@pytest.mark.parametrize("orders", [FOR_SETS, FOR_POINTS])
def test_what_is_found_of_a_set_does_not_depend_on_the_others(orders):
    """Bit for bit: sets that are decided early or late, that are halved, and that are given up."""
    config, sets, scale = several_sets(orders)
    until = np.array([0.02, np.inf, 0.05, 0.01])
    with proof_precision():
        equations = equations_of(partial(enclosed_system, config))

    def results(chosen, max_steps):
        last: dict[int, MotionSet] = {}
        times: dict[int, list[float]] = {}

        def decide(now, t, numbers):
            decisions = []
            for k, number in enumerate(numbers.tolist()):
                last[number] = now[k : k + 1]
                times.setdefault(number, []).append(float(t[k]))
                over = t[k] > until[chosen[number]]
                decisions.append(f"set {chosen[number]}" if over else None)
            return decisions

        states = together(*(sets[k] for k in chosen))
        with proof_precision():
            found = followed(equations, states, scale, decide, max_steps, orders)
        return {k: (found[i], last[i], times[i]) for i, k in enumerate(chosen)}

    many, backwards = results([0, 1, 2, 3], 6), results([3, 2, 1, 0], 6)
    for k in range(4):
        (alone,) = results([k], 6).values()
        for other in (many[k], backwards[k]):
            assert other[0] == alone[0]
            assert other[2] == alone[2]
            for name in ("polynomial", "frame", "radius"):
                assert np.array_equal(getattr(other[1], name), getattr(alone[1], name)), name
    ends = [many[k][0] for k in range(4)]
    assert len({end.steps for end in ends}) > 1
    assert [end.decision for end in ends if end.decision] == [
        f"set {k}" for k, end in enumerate(ends) if end.decision
    ]
    assert {end.decision is None for end in ends} == {True, False}
    assert all(end.time > until[k] for k, end in enumerate(ends) if end.decision)


def test_each_set_keeps_its_own_place(monkeypatch):
    """Steps of a mix: proved, not proved, and ended. Each set is the one of its number."""
    states, scale = any_set(error=1e-9)
    sets = together(*[states] * 4)
    sets.polynomial[:, 0, 0] = [0.0, 1.0, 2.0, 3.0]
    seen: list[dict[int, tuple[float, float]]] = []

    def step(equations, start, _scale, longest, orders):
        """The set at k is proved unless it is number 2; number 3 gets too wide at 3.5."""
        number = np.floor(start.polynomial[:, 0, 0] + 1e-9)
        proved = number != 2
        p, radius = start.polynomial.copy(), start.radius.copy()
        p[:, 0, 0] += np.where(proved, 0.25, np.nan)
        radius[p[:, 0, 0] > 3.4] = 1.0
        end = MotionSet(start.space, p, start.frame, radius)
        return SetSteps(np.where(proved, 0.001 * (1 + number), np.nan), end, proved)

    def decide(now, times, numbers):
        there = now.polynomial[:, 0, 0]
        seen.append(dict(zip(numbers.tolist(), zip(there, times, strict=True), strict=True)))
        return ["far" if x in {0.5, 1.75} else None for x in there]

    monkeypatch.setattr(set_motion, "set_steps", step)
    ends = followed(NO_EQUATIONS, sets, scale, decide)
    assert [end.decision for end in ends] == ["far", "far", None, None]
    assert [end.steps for end in ends] == [2, 3, 0, 1]
    assert [end.time for end in ends] == pytest.approx([0.002, 0.006, 0.0, 0.004])
    assert [end.variable is None for end in ends] == [True, True, False, False]
    for now in seen:
        for number, (there, t) in now.items():
            assert int(there) == number
            assert t == pytest.approx(0.004 * (1 + number) * (there - number))
    assert len(seen) > 4


def test_sets_are_replaced_where_that_is_said():
    states, _ = any_set()
    one, other = together(*[states] * 3), together(*[states] * 3)
    for part in (other.polynomial, other.frame, other.radius):
        part[:] = np.arange(3).reshape(3, *[1] * (part.ndim - 1))
    found = one.replaced(np.array([True, False, True]), other)
    for name in ("polynomial", "frame", "radius"):
        new, old, value = getattr(found, name), getattr(one, name), getattr(other, name)
        assert np.array_equal(new[::2], value[::2])
        assert np.array_equal(new[1], old[1])


def test_no_starts_need_no_steps():
    states, scale = any_set()
    assert followed(NO_EQUATIONS, states[np.zeros(1, bool)], scale, undecided) == []
