"""Rest states for all θ1 and θ3 lie in the box that is proved to contain them."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import brentq
from support.proofs import rest_states, unwrapped_rest_states
from support.rest import HEAVY, paper_system

from rbstab.proof.boxes import Box
from rbstab.proof.confine import confined, parts_of
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.exact.expr import variable
from rbstab.proof.model import RANGE_END, Energy
from rbstab.proof.regions.regions import regions_of
from rbstab.proof.search import Search
from rbstab.proof.zeros import newton

X, Y, Z, W = (variable(k) for k in range(4))
HALF = Fraction(1, 2)
STOP = Fraction(6, 5)


def energy(k=(1, 1, 1), p=0, couple=0, stop=None):
    K = HALF * (k[0] * X * X + k[1] * Y * Y + k[2] * Z * Z)
    return Energy(K + couple * X * Y + p, stop=stop)


@pytest.mark.parametrize("U", [X**3, X * Z.sin(), X * X * Y, X.exp(), 1 / X, X * X / Z, X / Y])
def test_other_energies_are_not_confined(U):
    assert parts_of(U) is None
    assert confined(Energy(U + HALF * (X * X + Z * Z))) is None


def test_without_stiffness_or_with_a_barrier_nothing_is_confined():
    assert confined(energy(k=(1, 1, 0))) is None
    assert confined(energy(k=(1, 1, -1))) is None
    closed = Energy(energy().U, closed=frozenset({0}))
    assert confined(closed) is None


@pytest.mark.parametrize("load", [0, 3])
def test_the_bound_is_above_what_a_known_state_needs(load):
    """½ (θ1² + θ3²) - 5 θ1 θ2 - load θ1: at θ2 = π/2 the state θ1 = 5 π/2 + load is reached."""
    limits = confined(energy(couple=-5, p=0 - load * X))
    assert limits is not None
    assert limits[0] >= 5 * np.pi / 2 + load
    assert limits[0] <= 1.01 * (5 * np.pi / 2 + load)
    assert limits[1] >= np.pi


@pytest.mark.parametrize("seed", range(2))
def test_all_zeros_are_inside(seed):
    """A search in a wider box, and Newton's method from far away, find none outside."""
    rng = np.random.default_rng(seed)
    c = rng.integers(2, 7, 3).tolist()
    p = c[0] * X.cos() * (1 + HALF * Y.sin()) + c[1] * Z.sin() * X.sin() + c[2] * Z.cos()
    E = energy(k=(1, 6, 2), p=p, couple=1, stop=STOP)
    with np.errstate(all="ignore"):
        limits = confined(E)
        assert limits is not None
        assert np.all(limits < 20)
        V = BoundedEnergy(E.U)
        starts = rng.uniform(-1, 1, (3, 300)) * np.array([[12.0], [1.2], [12.0]])
        ends, last = newton(V, starts, 150)
    inside = (last < 1e-10) & (np.abs(ends[1]) < 1.2)
    assert inside.sum() > 10
    assert np.all(np.abs(ends[0, inside]) <= limits[0])
    assert np.all(np.abs(ends[2, inside]) <= limits[1])
    # The bound on slopes is no guess: |∂p/∂θ1| is at most the sum of these magnitudes.
    assert limits[0] <= 1.2 * (1.2 + 1.5 * c[0] + c[1]) + np.pi


def test_the_bound_is_sharp_for_one_wave():
    """At rest 2 θ1 + 6 cos θ1 + 1 = 0, so |θ1| <= (6 + 1) / 2."""
    limits = confined(Energy(X * X + X + 6 * X.sin() + HALF * Y * Y + 2 * Z * Z))
    assert limits is not None
    assert 3.5 < limits[0] < 3.5 * 1.15
    assert limits[1] == RANGE_END[2]


def test_the_ends_of_a_box_that_confines_do_not_end_the_lowest_region():
    """½ (θ1² + 10 θ2² + θ3²) + 8 (1 - cos θ1): the next rest state has θ1 = -8 sin θ1."""
    body = replace(energy(k=(1, 10, 1), p=8 - 8 * X.cos()), closed=frozenset({1}))
    ends = confined(body)
    assert ends is not None
    end = np.array([ends[0], RANGE_END[1], ends[1]])
    zeros = Search(BoundedEnergy(body.U, least=body.least), Box(-end, end)).run(16_000)
    assert (zeros.proved, len(zeros.zeros)) == (True, 5)
    theta = brentq(lambda x: x + 8 * np.sin(x), 4.5, 6.5, xtol=1e-14)
    for confining, level in (
        (False, ends[1] ** 2 / 2),
        (True, theta**2 / 2 + 8 - 8 * np.cos(theta)),
    ):
        regions = regions_of(body, zeros, Box(-end, end), confining=confining)
        assert regions.certified is not None
        assert regions.certified.energy_bound == pytest.approx(level, rel=1e-6)
        assert regions.minima[0].rest_state == 1
        assert regions.minima[0].energy_bound == pytest.approx(level, rel=1e-5)


def test_a_stiff_body_is_not_searched_twice_and_a_very_soft_one_not_at_all():
    """Nothing of it is at rest beyond a half turn, so the range of eq. 5 has all."""
    stiff = rest_states(paper_system("embedded", weight=HEAVY))
    np.testing.assert_array_equal(stiff.end, RANGE_END)
    assert unwrapped_rest_states(stiff) is stiff
    assert stiff.unique is True
    assert unwrapped_rest_states(rest_states(paper_system("permanent", 0.01), proof=False)) is None
