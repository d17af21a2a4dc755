"""Protects the points of a design: their distribution, and their independence of the batch."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.stats import qmc

from rbstab.sweep.plan.designs import (
    DESIGNS,
    SOBOL_BITS,
    LatinHypercubeDesign,
    RandomDesign,
    SobolDesign,
)

POINTS = 1000

each_design = pytest.mark.parametrize("design", DESIGNS.values(), ids=list(DESIGNS))


def whole(design, dimensions=5, points=POINTS, seed=3):
    return design(dimensions, points, seed).draw(0, points)


@each_design
@settings(max_examples=40)
@given(cuts=st.lists(st.integers(0, POINTS), max_size=6))
def test_a_point_does_not_depend_on_the_cut(design, cuts):
    expected = whole(design)
    ends = [0, *sorted(cuts), POINTS]
    made = design(5, POINTS, 3)
    parts = [made.draw(start, stop) for start, stop in itertools.pairwise(ends)]
    assert np.hstack(parts).tobytes() == np.ascontiguousarray(expected).tobytes()
    assert expected.shape == (5, POINTS)
    assert 0 < expected.min() < expected.max() < 1


@each_design
def test_the_seed_counts(design):
    assert (whole(design) == whole(design)).all()
    others = [whole(design, seed=seed) for seed in (3, 4, 2**63 - 1, 0)]
    for i, points in enumerate(others):
        for other in others[:i]:
            assert not np.isclose(points, other, atol=1e-6).any(axis=1).all()


@each_design
def test_coordinates_are_uniform_and_independent(design):
    u = whole(design, points=4096)
    for coordinate in u:
        assert stats.kstest(coordinate, "uniform").pvalue > 1e-3
    assert np.abs(np.corrcoef(u) - np.eye(5)).max() < 0.06


def test_even_designs_are_more_even_than_chance():
    by_chance, even, latin = (
        qmc.discrepancy(whole(design, points=1024).T)
        for design in (RandomDesign, SobolDesign, LatinHypercubeDesign)
    )
    assert even < by_chance / 10
    assert latin < by_chance


def test_the_sobol_points_are_those_of_scipy():
    engine = qmc.Sobol(5, scramble=True, bits=SOBOL_BITS, seed=np.random.default_rng(3))
    expected = engine.random(1024).T
    points = whole(SobolDesign, points=1024)
    assert (points - expected == 0.5 ** (SOBOL_BITS + 1)).all()


@pytest.mark.parametrize("points", [1, 2, 7, 1000])
def test_a_latin_hypercube_has_one_point_in_each_interval(points):
    u = whole(LatinHypercubeDesign, points=points)
    for coordinate in u:
        assert sorted((coordinate * points).astype(int)) == list(range(points))
    if points == 1000:
        assert not (np.argsort(u[0]) == np.argsort(u[1])).all()
        jitter = u * points % 1
        assert stats.kstest(jitter.ravel(), "uniform").pvalue > 1e-3
        # The place of a point in its interval is independent of the interval.
        assert (np.argsort(jitter[0]) == np.floor(u[0] * points)).mean() < 0.1


def test_random_numbers_are_the_bits_of_philox():
    """Stored sweeps resume with these bits, under any version of numpy."""
    key = np.random.SeedSequence(11).generate_state(2, np.uint64).tolist()
    numbers = RandomDesign(3, 50, 11).draw(0, 50)
    for stream in range(3):
        bits = [word for n in range(1, 14) for word in philox([n, 0, 0, stream], key)][:50]
        assert numbers[stream].tolist() == [((word >> 12) + 0.5) / 2**52 for word in bits]


def philox(counter, key):
    """Return a block of Philox 4x64 with ten rounds (Salmon et al., 2011)."""
    mask = 2**64 - 1
    (a, b, c, d), (k0, k1) = counter, key
    for _ in range(10):
        first, second = a * 0xD2E7470EE14C6C93, c * 0xCA5A826395121157
        a, b, c, d = (second >> 64) ^ b ^ k0, second & mask, (first >> 64) ^ d ^ k1, first & mask
        k0, k1 = (k0 + 0x9E3779B97F4A7C15) & mask, (k1 + 0xBB67AE8584CAA73B) & mask
    return a, b, c, d
