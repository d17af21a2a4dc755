"""Motions that start inside a proved region, even close to its border, stay in it and v falls."""

from dataclasses import replace

import numpy as np
import pytest
from support.problems import problem, solve
from support.proofs import regions_of, rest_state_of, rest_states
from support.rest import random_rest_system
from support.systems import VARIANTS

from rbstab.elements.gravity import Gravity
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.attitude import regularity

SEEDS = range(6)


def system_of(variant, seed):
    """Return a system with random gains; under its light load most regions are not empty."""
    system = random_rest_system(np.random.default_rng(100 + seed), variant)
    gravity = system.elements[0]
    assert isinstance(gravity, Gravity)
    light = Gravity(0.2 * gravity.weight)
    return replace(system, elements=(light, *system.elements[1:]))


def energy(system, y):
    return float(system.observe(y).energy.sum())


def start_at(system, rest, level, direction):
    """Return the first state along a ray from the rest state with an energy `level` above it."""

    def above(t):
        return energy(system, rest + t * direction) - energy(system, rest) - level

    high = 1e-3
    while above(high) < 0:
        high *= 1.05
    low = high / 1.05 if high > 1e-3 else 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if above(middle) < 0 else (low, middle)
    return rest + low * direction


@pytest.mark.slow
@pytest.mark.parametrize("variant", VARIANTS)
def test_every_motion_from_inside_stays_and_falls(variant):
    followed = 0
    for seed in SEEDS:
        system = system_of(variant, seed)
        found = rest_states(system)
        region = regions_of(found).certified
        if region is None or region.lower_bound <= 0:
            continue
        lowest = rest_state_of(found, found.states[0])
        rest = system.start(lowest.motion, lowest.own)
        rng = np.random.default_rng(seed)
        for share in (0.5, 0.999):
            scales = np.repeat([1.0, 5.0, 0.3, 2.0, 0.3], 3)[: len(rest)]
            direction = scales * rng.normal(size=len(rest))
            start = start_at(system, rest, share * region.lower_bound, direction)
            assert regularity(start[0:3]) > 0
            run = solve("heyoka", problem(system, start, np.linspace(0, 3, 61), range_bound=1e-9))
            assert run.status is RunStatus.COMPLETED
            v = np.array([energy(system, y) for y in run.states]) - energy(system, rest)
            assert (np.diff(v) <= 1e-11 * v[0]).all()
            assert (np.abs(run.states[:, 0:3]) < [np.pi, np.pi / 2, np.pi]).all()
            followed += 1
    assert followed >= 6
