"""Motions that are enclosed together converge where single enclosures say so, and never falsely."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.paper_runs import paper_config

import rbstab
from rbstab.config.build import start_of
from rbstab.experiment.convergence import many_motions as module
from rbstab.experiment.convergence.convergence import Convergence, Undecided
from rbstab.experiment.convergence.decisions import PATIENCE
from rbstab.experiment.convergence.enclosed_system import enclosed_system
from rbstab.experiment.convergence.many_motions import Motions
from rbstab.experiment.convergence.region_bounds import region_energies
from rbstab.experiment.proof import prove

MAX_STEPS = 400
ROUND_OFF = 1e-14
"""A bound on the rounding of a start, relative to the size of its states."""


@cache
def many_of(variant):
    """Return the config of a paper's case, and what encloses its motions."""
    config = rbstab.load_config(paper_config(variant))
    return config, Motions(config, prove(config))


def starts_of(config, factors):
    """Return starts with the angular velocities of a config times some factors, as configs."""
    speeds = np.array(config.initial.angular_velocity)
    return [
        config.model_copy(
            update={
                "initial": config.initial.model_copy(
                    update={"angular_velocity": tuple((speeds * x).round(3).tolist())}
                )
            }
        )
        for x in factors
    ]


def values_of(configs):
    """Return the starts of configs in doubles, and bounds on their rounding."""
    values = []
    for config in configs:
        system = enclosed_system(config, lambda numbers: numbers)
        values.append(start_of(config, system))
    found = np.array(values)
    return found, ROUND_OFF * (1 + np.abs(found))


def motion_in_doubles(config, time):
    """Return the system and its state at a time."""
    system = enclosed_system(config, lambda numbers: numbers)
    end = solve_ivp(
        lambda _, y: system.rates(y),
        (0, max(time, 1e-9)),
        start_of(config, system),
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
    ).y[:, -1]
    return system, end


@pytest.mark.parametrize("variant", ["free", pytest.param("permanent", marks=pytest.mark.slow)])
def test_the_energy_of_a_computed_motion_is_inside_the_bounds(variant):
    config, many = many_of(variant)
    configs = starts_of(config, [1.0, 0.01, 0.8])
    found = many.follow_all(*values_of(configs), MAX_STEPS)
    rest = many.proof.states[0].energy
    for one, result in zip(configs, found, strict=True):
        decision = result.decision
        assert decision.proved is True
        assert decision.time == result.time
        low, high = decision.energy
        assert low <= high < decision.bound
        system, end = motion_in_doubles(one, result.time)
        v = system.observe(end).energy.sum() - rest
        assert low - 1e-7 * (1 + v) <= v <= high + 1e-7 * (1 + v)
    assert found[0].steps > 0
    assert (found[1].steps, found[1].time) == (0, 0.0)
    assert found[2].time < found[0].time


def test_numbers_without_bounds_prove_nothing():
    """Neither at the start nor later, and also where a start would be inside of a region."""
    config, many = many_of("visco-elastic")
    values, errors = values_of(starts_of(config, [0.01]))
    assert isinstance(many.follow_all(values, errors, 5)[0].decision, Convergence)
    broken = []
    for bad in (np.nan, np.inf, -np.inf, 1e200):
        for place in (0, 4, 7, 11):
            one = values.copy()
            one[0, place] = bad
            broken.append((one, errors))
            broken.append((values, np.where(np.arange(12) == place, abs(bad), errors)))
    found = many.follow_all(*(np.concatenate(parts) for parts in zip(*broken, strict=True)), 5)
    assert [one.decision for one in found] == [None] * len(broken)
    assert {one.steps for one in found} == {0}


def decisions_of(lows, highs, proof):
    """Return what is decided of motions with some bounds on their energies, shape (times, m)."""
    _, many = many_of("free")
    decide: Any = module.Decisions(proof, many.equations)

    class Bounds:
        @staticmethod
        def energy_bounds(states):
            return lows[states.k, states.numbers], highs[states.k, states.numbers]

    decide.equations = Bounds

    class States:
        def __init__(self, k, numbers):
            self.k, self.numbers = k, numbers

        def angle_bounds(self):
            return np.zeros((2, len(self.numbers), 3))

    numbers, found = np.arange(lows.shape[1]), {}
    for k in range(len(lows)):
        states = States(k, numbers)
        decided = decide(states, np.full(len(numbers), 0.1 * k), numbers)
        for number, one in zip(numbers.tolist(), decided, strict=True):
            if one is not None:
                found[number] = (k, one)
        numbers = np.array([n for n in numbers if n not in found], dtype=int)
    return found


def test_at_rest_outside_of_every_region():
    """Each motion by its own energies, also after others have ended before it."""
    _, many = many_of("free")
    level = max(bound for _, bound in region_energies(many.proof))
    k = np.arange(3 * PATIENCE)[:, np.newaxis]
    falls = level + 2000.0 - 1.0 * k
    stops = level + 1000.0 - np.minimum(k, 20)
    inside = level - 5.0 + 0.0 * k
    unknown = np.nan * k
    lows = np.hstack([inside, falls, stops, unknown, falls + 1e4 * (k < 5), stops])
    lows[0, 5] += 1e9  # so it has lost much more, and stops at the same time
    found = decisions_of(lows, lows + 1e-6, many.proof)
    assert sorted(found) == [0, 2, 5]
    assert found[0][0] == 0
    assert isinstance(found[0][1], Convergence)
    assert found[2] == (20 + PATIENCE, Undecided.AT_REST)
    # A fall of 1 J in 50 steps is nothing beside 1e9 J.
    assert found[5] == (PATIENCE + 1, Undecided.AT_REST)
