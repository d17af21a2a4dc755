"""Protects what is proved with a soft guard: the range is kept, and nothing rests beyond its angle.

The facts are found by scipy with the stored energy of the systems themselves, which no module of
the proofs computes, and the energy of the guard in closed form.
"""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import root
from support.bodies import least_energy
from support.proofs import energy_of_config as exact

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.elements.guards.soft_guards import RepellingGuard, StiffGuard
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.kept_range import (
    border_of_pitch,
    energy_at_most,
    energy_bound,
    guard_energy,
    nothing_rests_beyond,
)
from rbstab.proof.model import Energy

PAPER = Path(__file__).parents[2] / "configs" / "paper"
CASES = ["case1_permanent", "case2_visco_elastic"]


def case(name="case1_permanent", soft=1.0):
    data = load_config(PAPER / f"{name}.yaml").plain()
    data["controller"]["K_r"] = [soft * gain for gain in data["controller"]["K_r"]]
    return load_config(data)


def border_of(energy):
    border = border_of_pitch(energy)
    assert border is not None
    return border


def plane(stiffness=(0.0, 0.0, 0.0), linear=(0.0, 0.0, 0.0)):
    """Return an energy without sines and cosines."""
    terms = zip(map(variable, range(3)), map(expr, stiffness), map(expr, linear), strict=True)
    return Energy(sum((0.5 * k * x * x + q * x for x, k, q in terms), expr(0)))


@pytest.mark.parametrize("name", CASES)
def test_no_point_of_the_border_is_lower_and_one_is_as_low(name):
    config = case(name)
    border = border_of(exact(config))
    at_rest, rng = configurations(problem_of(config).system), np.random.default_rng(0)
    least = min(least_energy(at_rest, 1, sign * np.pi / 2, rng, 4) for sign in (-1, 1))
    assert border.energy <= least
    assert border.energy == pytest.approx(least, rel=1e-7)


def test_the_border_of_a_quadratic_energy():
    """The lower of both ends counts; without springs of θ1 and θ3 there is none."""
    quarter = np.pi / 2
    for load in (5.0, -5.0):
        border = border_of(plane((2.0, 3.0, 4.0), (0.0, load, 0.0)))
        assert border.energy == pytest.approx(1.5 * quarter**2 - 5.0 * quarter, rel=1e-12)
    assert border_of_pitch(plane((0.0, 1.0, 1.0))) is None


@pytest.mark.parametrize(
    ("kind", "added"),
    [
        (StiffGuard, lambda k, room: 0.5 * k * room**2),
        (RepellingGuard, lambda k, room: k * room),
    ],
)
def test_the_guard_adds_its_energy_at_the_border(kind, added):
    border = border_of(plane((2.0, 3.0, 4.0)))
    assert border.energy == pytest.approx(0.5 * 3.0 * (np.pi / 2) ** 2, rel=1e-12)
    for strength, angle in ((7.0, 1.2), (0.3, 0.1)):
        guard = guard_energy(kind, strength, angle)
        expected = border.energy + added(strength, np.pi / 2 - angle)
        bound = energy_bound(border, guard)
        assert expected * (1 - 1e-12) < bound <= expected * (1 + 1e-15)
        assert energy_at_most(guard, angle + 0.05) == pytest.approx(added(strength, 0.05))
        for inside in (0.0, 0.99 * angle):
            assert 0 <= energy_at_most(guard, inside) < 1e-298  # what covers underflow


def balances(at_rest, method, strength, soft_angle, seed):
    """Return the rest states with a guard beyond its angle that scipy finds."""
    rng, states = np.random.default_rng(seed), []

    def gradient(q):
        g = at_rest.gradient(q).copy()
        beyond = abs(q[1]) - soft_angle
        slope = strength * beyond if method is StiffGuard else strength
        g[1] += math.copysign(slope, q[1])
        return g

    for _ in range(60):
        q = np.zeros(at_rest.size)
        q[[0, 2]] = rng.uniform(-5, 5, 2)
        q[1] = rng.choice([-1, 1]) * rng.uniform(soft_angle, np.pi / 2)
        done = root(gradient, q, method="hybr")
        within = soft_angle < abs(done.x[1]) < np.pi / 2
        if done.success and within and np.abs(gradient(done.x)).max() < 1e-6:
            states.append(done.x[:3])
    return states


@pytest.mark.parametrize(
    ("soft", "kind", "strength", "soft_angle", "expected"),
    [
        (1.0, StiffGuard, 1e5, 1.2, True),
        (0.3, RepellingGuard, 100.0, 1.2, True),
        (0.3, StiffGuard, 100.0, 0.3, True),
        (0.3, StiffGuard, 100.0, 1.2, False),
    ],
)
def test_scipy_finds_a_rest_state_beyond_only_where_none_is_excluded(
    soft, kind, strength, soft_angle, expected
):
    config = case(soft=soft)
    f = exact(config)
    guard = guard_energy(kind, strength, soft_angle)
    excluded = nothing_rests_beyond(f, border_of(f), guard, soft_angle)
    states = balances(configurations(problem_of(config).system), kind, strength, soft_angle, 1)
    assert excluded is expected
    assert bool(states) is not expected


def test_a_load_may_press_against_a_repelling_guard():
    """U = |Θ|²/2 - 2 θ2: at θ2 = 1 the load is 1 N m, which any larger K balances there."""
    f = plane((1.0, 1.0, 1.0), (0.0, -2.0, 0.0))
    border = border_of(f)
    for strength, excluded in ((0.3, True), (0.9, False), (1.1, False), (1e4, False)):
        guard = guard_energy(RepellingGuard, strength, 1.0)
        assert nothing_rests_beyond(f, border, guard, 1.0) is excluded
    # A spring balances it a little beyond; without a load nothing rests there.
    spring = guard_energy(StiffGuard, 1e4, 1.0)
    assert not nothing_rests_beyond(f, border, spring, 1.0)
    for kind in (StiffGuard, RepellingGuard):
        free = plane((1.0, 1.0, 1.0))
        guard = guard_energy(kind, 0.01, 1.0)
        assert nothing_rests_beyond(free, border_of(free), guard, 1.0)
