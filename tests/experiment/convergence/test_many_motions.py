"""Motions that are enclosed together converge where single enclosures say so, and never falsely."""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.paper_runs import paper_config

import rbstab
from rbstab.config.build import start_of
from rbstab.experiment.convergence import many_motions as module
from rbstab.experiment.convergence.convergence import Convergence
from rbstab.experiment.convergence.decisions import PATIENCE
from rbstab.experiment.convergence.enclosed_system import enclosed_system
from rbstab.experiment.convergence.many_motions import Motions
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
    starts = np.array(values)
    return starts, ROUND_OFF * (1 + np.abs(starts))


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
    followed = many.follow_all(*values_of(configs), MAX_STEPS)
    rest = many.proof.states[0].energy
    for start, result in zip(configs, followed, strict=True):
        decision = result.decision
        assert decision.proved is True
        assert decision.time == result.time
        low, high = decision.energy
        assert low <= high < decision.bound
        system, end = motion_in_doubles(start, result.time)
        v = system.observe(end).energy.sum() - rest
        assert low - 1e-7 * (1 + v) <= v <= high + 1e-7 * (1 + v)
    assert followed[0].steps > 0
    assert (followed[1].steps, followed[1].time) == (0, 0.0)
    assert followed[2].time < followed[0].time


def test_numbers_without_bounds_prove_nothing():
    """Neither at the start nor later, and also where a start would be inside of a region."""
    config, many = many_of("visco-elastic")
    values, errors = values_of(starts_of(config, [0.01]))
    assert isinstance(many.follow_all(values, errors, 5)[0].decision, Convergence)
    broken = []
    for bad in (np.nan, np.inf, -np.inf, 1e200):
        for place in (0, 4, 7, 11):
            start = values.copy()
            start[0, place] = bad
            broken.append((start, errors))
            broken.append((values, np.where(np.arange(12) == place, abs(bad), errors)))
    followed = many.follow_all(*(np.concatenate(parts) for parts in zip(*broken, strict=True)), 5)
    assert [motion.decision for motion in followed] == [None] * len(broken)
    assert {motion.steps for motion in followed} == {0}


def test_at_rest_where_the_energy_has_stopped_falling():
    """Each motion by its own energies, relative to what it has lost."""
    _, many = many_of("free")
    decide = module.Decisions(many.proof, many.equations)
    k = np.arange(3 * PATIENCE)
    falls, stops = 2000.0 - k, 1000.0 - np.minimum(k, 20)
    lost_more = np.where(k == 0, 1e9, stops)
    motions = [falls, stops, np.nan * k, falls + 1e4 * (k < 5), lost_more]
    at_rest = [[decide._rests(n, low) for low in lows] for n, lows in enumerate(motions)]
    firsts = [rests.index(True) if any(rests) else None for rests in at_rest]
    # A fall of 1 J in 50 steps is nothing beside 1e9 J.
    assert firsts == [None, 20 + PATIENCE, None, None, PATIENCE + 1]
