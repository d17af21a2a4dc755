"""Round-off violates no derivative of v, and excuses none that is wrong."""

from dataclasses import replace

import numpy as np
import pytest
from support.evidence import (
    CONSISTENT,
    UNKNOWN,
    VIOLATED,
    check,
    evidence,
    state_of,
    states_of,
    stretched,
)
from support.problems import bare_system
from support.rest import DAMPING, K_R, K_T, paper_system

from rbstab.mechanics.body import Body
from rbstab.mechanics.derivatives import derivative_along


def error_in_doubles(system, y):
    """Return |∇v·f - v'| over the sum of the powers, in double precision."""
    parts = derivative_along(lambda z: system.observe(z).energy, y, system.rates(y))
    rate = -system.observe(y).dissipation.sum()
    return abs(parts.sum() - rate) / (np.abs(parts).sum() + abs(rate))


@pytest.mark.parametrize("variant", ["free", "embedded"])
def test_terms_that_cancel_do_not_violate_the_derivative(variant):
    system = stretched(variant)
    states = states_of(system)
    assert max(error_in_doubles(system, y) for y in states) > 1e-9
    checked = check(evidence(system, states), "derivative")
    assert checked.verdict is CONSISTENT
    assert checked.value <= checked.bound == 1e-9
    run = evidence(system, states)
    wrong = check(replace(run, rate=run.rate * (1.0 + 1e-6)), "derivative")
    assert wrong.verdict is VIOLATED
    assert wrong.bound < wrong.value <= 1e-6


def test_a_body_that_nothing_damps_is_consistent():
    """∇v·f is zero, and in double precision it is round-off of the couple -Ω × JΩ."""
    # Of a diagonal inertia, the powers of the couple cancel almost without round-off.
    inertia = np.array([[1.0, 0.1, 0.2], [0.1, 2.0, 0.3], [0.2, 0.3, 2.5]])
    system = bare_system(Body(2.0, inertia, np.array([0.3, 0.1, 0.2])))
    states = states_of(system)
    assert max(error_in_doubles(system, y) for y in states) > 0.1
    checked = check(evidence(system, states), "derivative")
    assert checked.verdict is CONSISTENT
    # No damping matrix of this system adds energy: all are zero.
    assert check(evidence(system, states), "damping").verdict is CONSISTENT


@pytest.mark.parametrize(("size", "verdict"), [(1e-11, CONSISTENT), (1e-3, VIOLATED)])
def test_the_powers_of_a_motion_that_has_come_to_rest_are_not_judged(size, verdict):
    """Its displacements and velocities are round-off, and its powers are squares of these."""
    system = paper_system("free")
    states = states_of(system)
    run = evidence(system, [*states, size * states[0]])
    rate = np.append(run.rate[:-1], 2.0 * run.rate[-1])
    assert abs(rate[-1]) > 0.0
    assert check(replace(run, rate=rate), "derivative").verdict is verdict


def turned(values):
    Q, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    matrix = Q @ np.diag(values) @ Q.T
    return 0.5 * (matrix + matrix.T), Q


def lost_digits():
    """Return a system and states whose v' is a small difference of large terms."""
    L_r, Q = turned([1e13, 1e6, 1.0])
    body = Body(41.0, np.diag([10.0, 8.0, 4.0]), np.array([0.15, 0.1, -0.42]))
    system = bare_system(body, K_t=K_T, L_t=DAMPING, K_r=K_R, L_r=L_r)
    soft = [np.concatenate([np.zeros(3), k * Q[:, 2], np.zeros(6)]) for k in (1.0, 0.7, 0.3)]
    return system, [state_of(system, Z) for Z in soft]


def test_a_rate_that_has_lost_its_digits_is_unknown():
    checked = check(evidence(*lost_digits()), "derivative")
    assert checked.verdict is UNKNOWN
    assert checked.value > checked.bound


@pytest.mark.parametrize(("error", "verdict"), [(1e-10, UNKNOWN), (1e-8, VIOLATED)])
def test_lost_digits_do_not_excuse_a_stored_rate_of_another_state(error, verdict):
    system, states = lost_digits()
    run = evidence(system, [1e3 * y for y in states])
    dissipated = np.abs(run.dissipation).sum(axis=1)
    wrong = replace(run, rate=run.rate + error * dissipated)
    assert check(wrong, "derivative").verdict is verdict
