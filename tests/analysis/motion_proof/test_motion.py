"""Enclosures of motions hold the exact motions, known to 30 digits by another method."""

from itertools import pairwise, product, takewhile

import numpy as np
import pytest
from flint import arb, ctx
from support.configs import BY_VARIANT, plain
from support.exact_motions import exact_decimals, middles, motion_of, state_after

from rbstab.analysis.motion_proof.dual import decimals
from rbstab.analysis.motion_proof.motion import (
    PRECISION,
    Unproved,
    angle_bounds,
    enclosed_motion,
    energy_bounds,
    scale_of,
    start_set,
)
from rbstab.analysis.motion_proof.step import StateSet, step_from
from rbstab.config.build import problem_of, start_of, system_of
from rbstab.config.load import load_config

FULL = [[500.0, 40.0, -30.0], [40.0, 420.0, 25.0], [-30.0, 25.0, 300.0]]


def config_of(variant, seed=0, **changes):
    """Return a config with a random start, full gains, and gravity."""
    rng = np.random.default_rng(seed)
    data = plain(BY_VARIANT[variant])
    initial = {
        "orientation": rng.uniform(-0.6, 0.6, 3).round(3).tolist(),
        "angular_velocity": rng.uniform(-20, 20, 3).round(3).tolist(),
    }
    if variant != "permanent":
        initial |= {
            "position": rng.uniform(-0.05, 0.05, 3).round(3).tolist(),
            "velocity": rng.uniform(-1, 1, 3).round(3).tolist(),
        }
    data["gravity"] = rng.uniform(-10, 10, 3).round(3).tolist()
    data["controller"]["K_r"] = FULL
    return load_config({**data, "initial": initial, **changes})


def enclosure(config):
    """Return the equations, the set of the start, and the scale of the states."""
    system, problem = system_of(config, decimals), problem_of(config)
    energy = float(np.abs(problem.system.observe(problem.start).energy).sum())
    scale = scale_of(problem.system, energy)
    return system, start_set(start_of(config, system, decimals), scale), scale


def enclosed_at(config, t):
    """Return the middle of the enclosure at a time, its width, and the number of steps."""
    with ctx.workprec(PRECISION):
        for count, step in enumerate(enclosed_motion(*enclosure(config)), start=1):
            if step.end_time >= t:
                return *step.state_at(t), count
    raise AssertionError


def outside(exact, middle, distance):
    """Return by how much each state is outside its enclosure, relative to the width."""
    with ctx.workprec(220):
        return [
            max(0.0, float(abs(e - m)) / d - 1)
            for e, m, d in zip(exact, middle, distance, strict=True)
        ]


@pytest.mark.parametrize("variant", BY_VARIANT)
@pytest.mark.parametrize("seed", [1, 2])
def test_the_exact_motion_is_inside(variant, seed):
    config = config_of(variant, seed)
    t, exact, change = list(motion_of(config, 2.0**-8, 5))[-1]
    assert change < 1e-30
    middle, distance, steps = enclosed_at(config, t)
    assert steps > 1
    assert outside(exact, middle, distance) == [0.0] * len(exact)
    assert distance.max() < 1e-13


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_the_error_is_not_far_below_its_bound(variant):
    """In one step, so that what is left out of the bound would be seen."""
    config = config_of(variant, 3)
    with ctx.workprec(PRECISION):
        step = next(enclosed_motion(*enclosure(config)))
        middle, distance = step.state_at(step.end_time)
    *_, (_, exact, change) = motion_of(config, step.end_time / 4, 4)
    assert change < 1e-30
    assert outside(exact, middle, distance) == [0.0] * len(exact)
    error = [float(abs(e - m)) / d for e, m, d in zip(exact, middle, distance, strict=True)]
    assert max(error) > 3e-3


@pytest.mark.parametrize("variant", ["permanent", "visco-elastic"])
def test_every_start_of_a_set_stays_in_it(variant):
    """The corners of a set go through its step; the set is so large that its curvature counts."""
    config = config_of(variant, 4)
    with ctx.workprec(PRECISION):
        system, start, scale = enclosure(config)
        n = len(scale)
        start = StateSet(start.centre, start.frame, np.full(n, 2e-8))
        step = step_from(system.rates, start, scale, 0.01)
    assert step is not None
    rng = np.random.default_rng(5)
    corners = rng.choice([-1.0, 1.0], size=(6, n))
    with ctx.workprec(220):
        exact_system = system_of(config, exact_decimals)
    largest = 0.0
    for corner in corners:
        with ctx.workprec(220):
            shift = (start.frame @ (corner * start.radius)).tolist()
            y = middles([c + x for c, x in zip(start.centre, shift, strict=True)])
            end = state_after(exact_system, y, step.h)
            from_centre = np.array(
                [float(e - c) for e, c in zip(end, step.end.centre, strict=True)]
            )
        in_frame = np.linalg.solve(step.end.frame, from_centre)
        assert np.all(np.abs(in_frame) <= step.end.radius * (1 + 1e-13))
        assert np.all(np.abs(from_centre) <= step.end.spread)
        largest = max(largest, float(np.max(np.abs(in_frame) / step.end.radius)))
    assert largest > 0.3, "the set at the end is far too wide"


def test_the_energy_of_a_set():
    config = config_of("embedded", 6)
    with ctx.workprec(PRECISION):
        system, start, scale = enclosure(config)
        wide = StateSet(start.centre, start.frame, np.full(len(scale), 1e-3))
        low, high = energy_bounds(system, wide)
        exact = energy_bounds(system, start)
    doubles = problem_of(config).system
    rng = np.random.default_rng(8)
    centre = np.array([float(x) for x in start.centre])
    energies = [
        doubles.observe(centre + wide.frame @ (1e-3 * corner)).energy.sum()
        for corner in rng.choice([-1.0, 1.0], size=(200, len(scale)))
    ]
    assert low < min(energies)
    assert max(energies) < high
    assert max(energies) - min(energies) > 0.1 * (high - low)
    assert exact[0] <= doubles.observe(centre).energy.sum() * (1 + 1e-14)
    assert exact[1] - exact[0] < 1e-10


def test_the_angles_of_a_set():
    frame = np.eye(6)
    frame[0, 3] = 2.0
    states = StateSet([arb(x) for x in (0.1, -0.2, 0.3, 1, 2, 3)], frame, np.full(6, 0.01))
    low, high = angle_bounds(states)
    assert low == pytest.approx([0.07, -0.21, 0.29])
    assert high == pytest.approx([0.13, -0.19, 0.31])
    corners = [states.centre[0] + s * 0.01 + 0.02 * t for s, t in product((-1, 1), repeat=2)]
    assert all(low[0] <= float(x) <= high[0] for x in corners)


def test_a_motion_that_comes_near_the_border_of_the_angles_is_given_up():
    given = config_of("permanent", 7)
    initial = {"orientation": (0.0, 1.5, 0.0), "angular_velocity": (0.0, 300.0, 0.0)}
    fast = given.model_copy(update={"initial": given.initial.model_copy(update=initial)})
    with ctx.workprec(PRECISION):
        motion = enclosed_motion(*enclosure(fast))
        with pytest.raises(Unproved):
            list(takewhile(lambda step: step.end_time < 1.0, motion))


def test_times_are_sums_without_rounding():
    config = config_of("free", 9)
    with ctx.workprec(PRECISION):
        motion = enclosed_motion(*enclosure(config))
        steps = [next(motion) for _ in range(5)]
    for before, after in pairwise(steps):
        assert after.time == before.end_time
        assert (after.time * 2.0**40).is_integer()
