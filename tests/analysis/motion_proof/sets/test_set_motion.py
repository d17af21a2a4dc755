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
from support.start_sets import random_config, random_set

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
from rbstab.analysis.motion_proof.sets.set_step import SetStep
from rbstab.experiment.convergence.enclosed_system import enclosed_system

NO_EQUATIONS: Any = None
"""Steps that are replaced need none."""


def any_set(**options):
    return random_set(random_config("permanent", "reduced", 5), 7, **options)


def steps_of(monkeypatch, lengths):
    """Replace the proof of steps: each has a given length; None stands for no proof."""
    asked = []

    def step(equations, start, scale, longest):
        asked.append(longest)
        h = lengths(len(asked), longest)
        return None if h is None else SetStep(h, start)

    monkeypatch.setattr(set_motion, "set_step", step)
    return asked


def test_the_time_is_never_below_the_sum_of_all_steps(monkeypatch):
    """0.1 added ten times in doubles is below ten times that double."""
    states, scale = any_set()
    steps_of(monkeypatch, lambda *_: 0.1)
    times = []

    def decision(_, t):
        times.append(t)
        return "done" if len(times) == 400 else None

    found = followed(NO_EQUATIONS, states, scale, decision)
    assert (found.steps, found.decision, found.variable) == (399, "done", None)
    assert found.time == times[-1]
    for count, t in enumerate(times):
        assert count * Fraction(0.1) <= Fraction(t) <= count * Fraction(0.1) * (1 + Fraction(1e-12))


def test_a_start_that_is_decided_needs_no_step(monkeypatch):
    states, scale = any_set()
    asked = steps_of(monkeypatch, lambda *_: None)
    found = followed(NO_EQUATIONS, states, scale, lambda *_: "inside")
    assert (found.steps, found.time, found.decision, asked) == (0, 0.0, "inside", [])


def test_shorter_steps_are_tried_before_a_set_is_halved(monkeypatch):
    states, scale = any_set()
    asked = steps_of(monkeypatch, lambda *_: None)
    found = followed(NO_EQUATIONS, states, scale, lambda *_: None)
    assert found.steps == 0
    assert found.decision is None
    assert found.variable == states.nonlinearity(scale).argmax()
    assert asked[0] == FIRST_STEP
    assert asked[1:] == [x / 2 for x in asked[:-1]]
    assert len(asked) > 3


def test_a_set_with_a_large_error_is_halved(monkeypatch):
    states, scale = any_set(error=1.0)
    steps_of(monkeypatch, lambda *_: 0.001)
    for error, variable in ((0.1, True), (np.nan, True), (1e-4, False)):
        wide = replace(states, radius=np.full(6, error))
        found = followed(NO_EQUATIONS, wide, scale, lambda *_: None)
        assert (found.variable is not None) == variable
        assert found.steps == (0 if variable else MAX_STEPS)


def test_a_set_is_given_up_after_all_steps(monkeypatch):
    states, scale = any_set()
    asked = steps_of(monkeypatch, lambda _, longest: longest)
    found = followed(NO_EQUATIONS, states, scale, lambda *_: None)
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
        found = followed(equations, states, scale, decision)
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
        slack = np.abs(np.linalg.inv(sets[-1].frame)) @ (1e-11 * scale)
        assert np.all(np.abs(place) <= sets[-1].radius + slack)
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
        assert np.all(np.abs(place_in_frame(one.start, z.tolist(), y)) <= one.start.radius)
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
