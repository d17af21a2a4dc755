"""Protects values in groups: quantiles of all groups at once are those of each group by itself."""

import numpy as np
import pytest

from rbstab.report.sweeps.distributions import quantiles_of
from rbstab.report.sweeps.maps.grouped import Ascending, Grouped

ORDERS = (0.0, 0.05, 0.3, 0.5, 0.95, 1.0)


@pytest.mark.parametrize("special", [None, np.nan, np.inf])
def test_quantiles_of_groups_are_those_of_each_group(rng, special):
    """Group 3 has no members, group 5 has one; in the others some values are NaN or infinite."""
    groups = rng.choice([0, 1, 2, 4, 6], 400)
    groups[7] = 5
    values = rng.normal(size=400).round(1)
    if special is not None:
        values[rng.choice(400, 60, replace=False)] = special
        values[groups == 6] = special
    found = Grouped(groups, 8).quantiles(Ascending(values), ORDERS)
    expected = [quantiles_of(values[groups == k], ORDERS) for k in (0, 1, 2, 4, 5, 6)]
    np.testing.assert_allclose(found.T, expected, rtol=1e-14)


def test_values_are_sorted_once_for_different_groups(rng):
    values = rng.normal(size=200)
    ascending = Ascending(values)
    for count in (1, 3, 300):
        groups = rng.integers(0, count, 200)
        grouped = Grouped(groups, count)
        found = grouped.quantiles(ascending, (0.5,))[0]
        medians = grouped.medians(values)[grouped.counts > 0]
        # Half of the sum of two values, or one and half of their distance: values are about 1.
        np.testing.assert_allclose(found, medians, rtol=0, atol=1e-15)


def test_without_values_nothing_is_known():
    found = Grouped(np.array([0, 1, 1]), 2).quantiles(Ascending(np.full(3, np.nan)), ORDERS)
    assert found.shape == (6, 2)
    assert np.isnan(found).all()
