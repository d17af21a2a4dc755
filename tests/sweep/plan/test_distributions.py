"""Protects lists and quantiles of distributions against numpy, SciPy and closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from rbstab.sweep.plan.distributions import (
    MIN_VALUE,
    Geomspace,
    Linspace,
    Logspace,
    LogUniform,
    Normal,
    Uniform,
    Values,
)

U = np.concatenate([[MIN_VALUE, 1 - MIN_VALUE], np.linspace(0.001, 0.999, 777)])

NUMBERS = st.floats(-1e6, 1e6)


def entries(distribution):
    return distribution.at(np.arange(distribution.length))


@given(NUMBERS, NUMBERS, st.integers(1, 300))
def test_lists_are_those_of_numpy(first, last, count):
    numbers, expected = entries(Linspace((first, last, count))), np.linspace(first, last, count)
    assert numbers.tobytes() == expected.tobytes() or (numbers == expected).all()
    a, b = first / 4e4, last / 4e4
    numbers = entries(Logspace((a, b, count)))
    np.testing.assert_allclose(numbers, np.logspace(a, b, count), rtol=1e-14)
    low, high = abs(first) + 1e-9, abs(last) + 1e-9
    numbers = entries(Geomspace((low, high, count)))
    np.testing.assert_allclose(numbers, np.geomspace(low, high, count), rtol=1e-13)
    assert numbers[0] == low
    assert count == 1 or numbers[-1] == high
    assert min(low, high) <= numbers.min() <= numbers.max() <= max(low, high)


PAIRS = [
    (Uniform((-2.0, 5.0)), stats.uniform(-2.0, 7.0)),
    (Uniform((1e-3, 1e9)), stats.uniform(1e-3, 1e9 - 1e-3)),
    (Normal((3.0, 0.5)), stats.norm(3.0, 0.5)),
    (Normal((-1e3, 40.0)), stats.norm(-1e3, 40.0)),
    (LogUniform((1e-3, 20.0)), stats.loguniform(1e-3, 20.0)),
]


@pytest.mark.parametrize(("distribution", "reference"), PAIRS)
def test_quantiles_are_those_of_scipy(distribution, reference):
    scale = reference.ppf(0.75) - reference.ppf(0.25)
    np.testing.assert_allclose(
        distribution.quantile(U), reference.ppf(U), rtol=1e-12, atol=1e-13 * scale
    )


@given(NUMBERS, st.floats(1e-6, 1e6), st.floats(MIN_VALUE, 1 - MIN_VALUE))
def test_no_value_leaves_the_ends(a, width, u):
    positive = abs(a) + 1e-9
    for distribution in (
        Uniform((a, a + width + abs(a))),
        Normal((a, width)),
        LogUniform((positive, positive + width)),
        Linspace((a, width, 7)),
        Geomspace((positive, width, 7)),
        Logspace((a / 1e5, 2.0, 7)),
        Values((a, 3.0, width)),
    ):
        low, high = distribution.bounds
        assert low <= distribution.quantile(np.array([u]))[0] <= high


def test_no_value_leaves_narrow_ends():
    """Here the distribution is as narrow as round-off."""
    for a in (435659.5, 0.1, 1e-300, 7e300):
        b = np.nextafter(np.nextafter(a, np.inf), np.inf)
        for distribution in (Uniform((a, b)), LogUniform((a, b))):
            values = distribution.quantile(U)
            assert a <= values.min() <= values.max() <= b


def test_coordinates_pick_each_entry_equally_often_and_the_last_one_the_last():
    u = np.array([MIN_VALUE, 1 - MIN_VALUE])
    for length in (1, 2, 3, 2**20 + 1, 10**8, *range(5, 2000, 3)):
        assert Linspace((0, length - 1, length)).quantile(u).tolist() == [0, length - 1]
    middles = (np.arange(600) + 0.5) / 600
    assert (np.bincount(Linspace((0, 9, 10)).quantile(middles).astype(int)) == 60).all()


def test_values_are_taken_as_they_are():
    values = Values((3.0, -1.0, 3.0))
    assert values.at(np.array([2, 1, 0, 1])).tolist() == [3.0, -1.0, 3.0, -1.0]
    assert values.bounds == (-1.0, 3.0)
    names = Values.model_validate(["free", "permanent"]).at(np.array([1, 0]))
    assert names.tolist() == ["permanent", "free"]
    assert names.dtype == object


ALL = [pair[0] for pair in PAIRS] + [
    Linspace((-1.1, 7.3, 1001)),
    Logspace((-3.3, 2.1, 1001)),
    Geomspace((0.013, 7.7, 1001)),
]


@pytest.mark.parametrize("distribution", ALL, ids=lambda d: d.keyword)
@settings(max_examples=30)
@given(start=st.integers(0, 500), length=st.integers(0, 279))
def test_a_value_depends_on_its_coordinate_alone(distribution, start, length):
    """Vectorised functions must give the same bits at the end of an array as in its middle."""
    whole = distribution.quantile(U)
    part = distribution.quantile(U[start : start + length].copy())
    assert part.tobytes() == whole[start : start + length].tobytes()
