"""Quadratic forms of the quaternion: eigenvectors against numpy, and equal eigenvalues."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbstab.proof.rotations.davenport import eigen_states

PLACES = [(row, column) for row in range(4) for column in range(row + 1)]

ENTRY = st.integers(-20, 20)


def turned(eigenvalues):
    """A matrix with these eigenvalues, in rational numbers: turned by a rational orthogonal one."""
    v = [Fraction(1), Fraction(2), Fraction(-1), Fraction(3)]
    size = sum(x * x for x in v)
    H = [[Fraction(int(i == j)) - 2 * v[i] * v[j] / size for j in range(4)] for i in range(4)]
    n = range(4)
    return [[sum(H[i][k] * eigenvalues[k] * H[j][k] for k in n) for j in n] for i in n]


@given(st.lists(ENTRY, min_size=10, max_size=10))
def test_the_states_are_the_eigenvectors_and_indices_their_order(entries):
    Q = [[Fraction(0)] * 4 for _ in range(4)]
    for (i, j), x in zip(PLACES, entries, strict=True):
        Q[i][j] = Q[j][i] = Fraction(x, 7)
    values, vectors = np.linalg.eigh(np.array(Q, dtype=float))
    rotations = eigen_states(Q)
    assert not rotations.why
    for state in rotations.states:
        assert state.energy == pytest.approx(values[state.index], abs=1e-9)
        assert state.low <= state.high
        if np.diff(values).min() > 1e-3:
            assert abs(vectors[:, state.index] @ state.quaternion) == pytest.approx(1, abs=1e-9)
    dimensions = sum(family.dimension + 1 for family in rotations.families)
    assert len(rotations.states) + dimensions == 4


@pytest.mark.parametrize(
    ("eigenvalues", "indices", "families"),
    [
        ([1, 2, 3, 4], [0, 1, 2, 3], []),
        ([1, 2, 2, 4], [0, 3], [(2, 1, 1)]),
        ([5, 5, 7, 7], [], [(5, 0, 1), (7, 2, 1)]),
        ([3, 3, 3, 3], [], [(3, 0, 3)]),
    ],
)
def test_equal_eigenvalues_are_families_exactly(eigenvalues, indices, families):
    rotations = eigen_states(turned([Fraction(x) for x in eigenvalues]))
    assert [state.index for state in rotations.states] == indices
    assert [
        (eigenspace.energy, eigenspace.index, eigenspace.dimension)
        for eigenspace in rotations.families
    ] == [pytest.approx(family) for family in families]
    assert rotations.proved == (not families)


def test_eigenvalues_that_doubles_cannot_tell_apart_are_different():
    near = [Fraction(1), Fraction(1) + Fraction(1, 10**60), Fraction(2), Fraction(3)]
    rotations = eigen_states(turned(near))
    assert rotations.proved
    assert [state.index for state in rotations.states] == [0, 1, 2, 3]
    # The eigenvectors are the columns of the rational matrix, to round-off.
    first, second = (state.quaternion for state in rotations.states[:2])
    assert abs(first @ second) < 1e-12
    exact = np.array([1, 0, 0, 0]) - 2 * np.array([1, 2, -1, 3]) / 15
    assert abs(first @ exact) == pytest.approx(1, abs=1e-12)
