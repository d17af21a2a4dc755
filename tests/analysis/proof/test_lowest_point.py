"""Protects lemma 14: where a convex function is least, from bounds on its second derivatives."""

from functools import partial

import numpy as np
import pytest
from flint import arb

from rbstab.analysis.proof.lines.intervals import Intervals, between, exact
from rbstab.analysis.proof.lowest_point import lost, lowest_point, scaling
from rbstab.analysis.proof_check.lowest_point import lowest_point as checked

MATRICES = {
    "one": [[3.0]],
    "two": [[2.0, 0.5], [0.5, 1.0]],
    "three": [[4.0, 1.0, 0.2], [1.0, 3.0, -0.5], [0.2, -0.5, 2.0]],
}


@pytest.mark.parametrize("name", MATRICES)
@pytest.mark.parametrize("spread", [0.0, 0.1, 0.25])
def test_the_lowest_point_of_quadratics_is_within_the_bounds(name, spread):
    """H is anywhere between two matrices, and the slopes at 0 anywhere between ±g."""
    H, rng = np.array(MATRICES[name]), np.random.default_rng(0)
    n, B = len(H), scaling(np.array(MATRICES[name])[np.newaxis])
    size = spread * np.abs(np.diag(H)).min() / n
    g = np.linspace(1.0, 0.3, n)
    loads = np.abs(B[0].T) @ g

    def bend(_):
        M = [B[0].T @ (H + size * s) @ B[0] for s in corners(n)]
        return between(np.min(M, axis=0)[np.newaxis], np.max(M, axis=0)[np.newaxis])

    found = lowest_point(B, loads[np.newaxis], 8.0, bend)
    assert found.proved[0]
    also = checked([arb(one) for one in loads], 8, lambda _: balls(bend(_)))
    assert also is not None
    by_checker = np.abs(B[0]) @ [float(one) for one in also[0]]
    for _ in range(200):
        noise = rng.uniform(-size, size, (n, n))
        one = H + 0.5 * (noise + noise.T)
        zeta = -np.linalg.solve(one, g * rng.choice([-1.0, 1.0], n))
        assert np.all(np.abs(zeta) <= found.widths[0])
        assert np.all(np.abs(zeta) <= by_checker)
        least = np.linalg.eigvalsh(B[0].T @ one @ B[0]).min()
        assert least >= max(found.least[0], float(also[1]))
        mixed = rng.normal(size=(n, 3))
        taken = mixed.T @ np.linalg.solve(one, mixed)
        assert np.all(np.abs(taken) <= lost(B, exact(mixed[np.newaxis]), found.least)[0])


def balls(M):
    rows = zip(M.middle[0].tolist(), M.radius[0].tolist(), strict=True)
    return [[arb(*entry) for entry in zip(*row, strict=True)] for row in rows]


def corners(n):
    """Return symmetric matrices of entries between -1 and 1, with the largest of each."""
    for sign in (-1.0, 1.0):
        for i in range(n):
            for j in range(i + 1):
                one = np.zeros((n, n))
                one[i, j] = one[j, i] = sign
                yield one
        yield np.full((n, n), sign)
    rng = np.random.default_rng(5)
    for _ in range(500):
        noise = np.sign(rng.normal(size=(n, n)))
        yield np.triu(noise) + np.triu(noise, 1).T


@pytest.mark.parametrize("least", [-0.1, 0.0, 0.04, 0.3, 0.49])
def test_too_small_second_derivatives_prove_nothing(least):
    """With |ξ| <= 2 |g|, the slope on a face is positive only if M > ½."""
    one = np.array([[[1.0]]])

    def bend(_):
        return between(least * one, 5.0 * one)

    assert not lowest_point(one, one[0], 2.0, bend).proved[0]
    assert checked([arb(1)], 2, lambda _: [[arb(least).union(arb(5))]]) is None


def test_a_second_derivative_above_one_half_is_enough():
    """Krawczyk's test would need |M - 1| < ½."""
    one = np.array([[[1.0]]])
    found = lowest_point(one, one[0], 2.0, lambda _: between(0.51 * one, 5.0 * one))
    assert found.proved[0]
    assert found.least[0] == pytest.approx(0.51)
    assert 1 / 0.51 <= found.widths[0, 0] < 1.97
    also = checked([arb(1)], 2, lambda _: [[arb(0.51).union(arb(5))]])
    assert also is not None
    sizes, least = also
    assert float(least) == pytest.approx(0.51)
    assert 1 / 0.51 <= float(sizes[0]) < 1.97


def returned(M, _):
    return M


def test_no_number_proves_nothing():
    one = np.array([[[1.0]]])
    for middle, radius in ((np.nan, 1.0), (1.0, np.inf), (1.0, np.nan)):
        bend = partial(returned, Intervals(middle * one, radius * one))
        with np.errstate(all="ignore"):
            assert not lowest_point(one, one[0], 2.0, bend).proved[0]
    assert checked([arb(1)], 2, lambda _: [[arb("nan")]]) is None
    nothing = lowest_point(one, np.nan * one[0], 2.0, lambda _: exact(one))
    assert not nothing.proved[0]
