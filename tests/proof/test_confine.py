"""Rest states for all θ1 and θ3 lie in the box that is proved to contain them."""

from fractions import Fraction

import numpy as np
import pytest

from rbstab.proof.bounds import BoundedEnergy
from rbstab.proof.confine import confined, parts_of
from rbstab.proof.expr import expr, variable
from rbstab.proof.model import Energy
from rbstab.proof.search import Box, Search, newton

X, Y, Z, W = (variable(k) for k in range(4))
HALF = Fraction(1, 2)
END = float(np.nextafter(np.pi / 2, 2))


def energy(k=(1, 1, 1), p=0, couple=0):
    K = HALF * (k[0] * X * X + k[1] * Y * Y + k[2] * Z * Z)
    return Energy(K + couple * X * Y + p)


def test_an_energy_is_taken_apart_exactly():
    p = X.sin() * Y.cos() + Y**2 * HALF + (Z.cos() + 2).sqrt()
    U = HALF * (3 * X * X + 5 * Z * Z) + 2 * X * Z + 7 * X * Y - 4 * Z * Y + 9 * X + p
    parts = parts_of(U)
    assert parts is not None
    assert [[parts.K[i][j] for j in (0, 2)] for i in (0, 2)] == [[3, 2], [2, 5]]
    assert [parts.K[0][1], parts.K[2][1]] == [7, -4]
    assert [parts.q[0], parts.q[2]] == [9, 0]
    assert parts.p == p


@pytest.mark.parametrize(
    "U", [X**3, X * Y * Y, X * Z.sin(), X * X * Y, (2 * X).sin() + X * X, X.exp(), 1 / X]
)
def test_other_energies_are_not_confined(U):
    assert parts_of(U) is None
    assert confined(Energy(U + HALF * (X * X + Z * Z)), END) is None


def test_without_stiffness_or_with_a_barrier_nothing_is_confined():
    assert confined(energy(k=(1, 1, 0)), END) is None
    assert confined(energy(k=(1, 1, -1)), END) is None
    closed = Energy(energy().U, closed=frozenset({0}))
    assert confined(closed, END) is None


@pytest.mark.parametrize("load", [0, 3])
def test_the_bound_is_above_what_a_known_state_needs(load):
    """½ (θ1² + θ3²) - 5 θ1 θ2 - load θ1: at θ2 = π/2 the state θ1 = 5 π/2 + load is reached."""
    found = confined(energy(couple=-5, p=0 - load * X), END)
    assert found is not None
    assert found[0] >= 5 * np.pi / 2 + load
    assert found[0] <= 1.01 * (5 * np.pi / 2 + load)
    assert found[1] >= np.pi


@pytest.mark.parametrize("seed", range(4))
def test_all_zeros_are_inside(seed):
    """A search in a wider box, and Newton's method from far away, find none outside."""
    rng = np.random.default_rng(seed)
    c = rng.integers(2, 7, 3).tolist()
    p = c[0] * X.cos() * (1 + HALF * Y.sin()) + c[1] * Z.sin() * X.sin() + c[2] * Z.cos()
    E = energy(k=(1, 6, 2), p=p, couple=1)
    with np.errstate(all="ignore"):
        found = confined(E, 1.2)
        assert found is not None
        assert np.all(found < 20)
        V = BoundedEnergy(E.U)
        starts = rng.uniform(-1, 1, (3, 300)) * np.array([[12.0], [1.2], [12.0]])
        ends, last = newton(V, starts, 150)
    inside = (last < 1e-10) & (np.abs(ends[1]) < 1.2)
    assert inside.sum() > 10
    assert np.all(np.abs(ends[0, inside]) <= found[0])
    assert np.all(np.abs(ends[2, inside]) <= found[1])
    # The bound on slopes is no guess: |∂p/∂θ1| is at most the sum of these magnitudes.
    assert found[0] <= 1.2 * (1.2 + 1.5 * c[0] + c[1]) + np.pi


def test_a_search_beyond_the_box_finds_nothing_more():
    E = energy(k=(1, 3, 1), p=2 * X.cos() + 2 * Z.cos() * Y.cos(), couple=HALF)
    ends = confined(E, 1.2)
    assert ends is not None
    V = BoundedEnergy(E.U)
    near, far = (
        Search(V, Box(-end, end)).run(60_000)
        for end in (np.array([ends[0], 1.2, ends[1]]), np.array([9.0, 1.2, 9.0]))
    )
    assert near.proved
    assert far.proved
    assert len(near.zeros) == len(far.zeros) > 3
    assert isinstance(expr(0) + E.U, type(E.U))
