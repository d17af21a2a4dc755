"""Exact arithmetic gives the energies and powers of double precision without its round-off."""

from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from flint import arb
from support.rest import system_of
from support.systems import VARIANTS, random_Z

from rbstab.analysis.exact import (
    ball,
    balls,
    decimals,
    exact_powers,
    exact_rank,
    in_balls,
    is_positive_definite,
)
from rbstab.mechanics.derivatives import derivative_along, jacobian
from rbstab.mechanics.motion import motion_from_centre


@pytest.fixture(params=VARIANTS)
def system(request):
    return system_of(request.param)


@pytest.fixture
def y(system):
    motion = motion_from_centre(system.body, system.anchor, random_Z(np.random.default_rng(2)))
    return system.start(motion, np.full(system.size - system.coordinates.size, 0.1))


def test_powers_are_those_in_double_precision(system, y):
    powers = in_balls(lambda: exact_powers(system, y))
    parts = derivative_along(lambda z: system.observe(z).energy, y, system.rates(y))
    np.testing.assert_allclose([float(p) for p in powers.by_part], parts, rtol=1e-9, atol=1e-9)
    observed = system.observe(y)
    assert float(powers.rate) == pytest.approx(-observed.dissipation.sum(), rel=1e-12)
    contact = observed.motion.F @ observed.contact_force
    assert float(powers.contact) == pytest.approx(contact, rel=1e-9, abs=1e-9)
    by_state = jacobian(lambda z: system.observe(z).energy, y) * system.rates(y)
    assert powers.terms == pytest.approx(np.abs(by_state).sum(), rel=1e-12)

    def imbalance():
        powers = exact_powers(system, y)
        return abs(sum(powers.by_part, ball(0.0)) - powers.rate)

    assert float(in_balls(imbalance)) < 1e-200  # far below round-off


def test_what_does_not_accept_balls_gives_nothing():
    assert in_balls(lambda: np.sin(balls(np.ones(3)) * 1j)) is None
    assert in_balls(partial(getattr, arb(1), "nothing")) is None


@pytest.mark.parametrize(
    ("matrix", "rank"),
    [
        (np.eye(3), 3),
        (np.zeros((3, 3)), 0),
        (np.diag([1.0, 1.0, 0.0]), 2),
        (np.diag([-1.0, -1.0, 1.0]), None),
        (np.diag([0.0, -5e-324, 1.0]), None),
        (np.diag([5e-324, 1e300, 1.0]), 3),
        ([[1, 1, 0], [1, 1 + 2.0**-52, 0], [0, 0, 1]], 3),
        ([[1, 1, 0], [1, 1, 0], [0, 0, 1]], 2),
        # Only its symmetric part counts.
        ([[1, 9, 0], [-9, 1, 0], [0, 0, 1]], 3),
        ([[1, 3, 0], [0, 1, 0], [0, 0, 1]], None),
    ],
)
def test_the_rank_tells_definite_matrices_without_round_off(matrix, rank):
    matrix = np.array(matrix, dtype=float)
    for order in ([0, 1, 2], [2, 0, 1]):
        moved = matrix[np.ix_(order, order)]
        assert exact_rank(moved) == rank
        assert is_positive_definite(moved) is (rank == 3)
        assert is_positive_definite(moved, or_semi=True) is (rank is not None)


def test_doubles_of_a_config_mean_decimals():
    fractions = decimals(np.array([[0.4, 1e-300], [-0.1, 12300.0]]))
    expected = [[Fraction(2, 5), Fraction(1, 10**300)], [Fraction(-1, 10), Fraction(12300)]]
    assert fractions.tolist() == expected
    # A double is not the decimal, but it is the nearest one to it.
    assert Fraction(0.4) != fractions[0, 0]
    assert float(fractions[0, 0]) == 0.4
