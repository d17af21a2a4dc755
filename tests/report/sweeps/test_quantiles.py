"""Protects quantiles of values in groups: those of all groups at once are those of each group."""

from typing import Literal

import numpy as np
import pytest

from rbstab.report.sweeps.quantiles import Ascending, quantiles_by_group, quantiles_of

ORDERS = (0.0, 0.05, 0.3, 0.5, 0.95, 1.0)


@pytest.mark.parametrize("special", [None, np.nan, np.inf])
def test_quantiles_of_groups_are_those_of_each_group(rng, special):
    """Groups 3 and 7 have no members, group 5 has one; some values are NaN or infinite."""
    groups = rng.choice([0, 1, 2, 4, 6], 400)
    groups[7] = 5
    values = rng.normal(size=400).round(1)
    if special is not None:
        values[rng.choice(400, 60, replace=False)] = special
        values[groups == 6] = special
    quantiles = quantiles_by_group(groups, 8, Ascending(values), ORDERS)
    assert np.isnan(quantiles[:, [3, 7]]).all()
    for group in (0, 1, 2, 4, 5, 6):
        group_values = values[(groups == group) & ~np.isnan(values)]
        expected = np.full(6, np.nan)
        if len(group_values):
            is_finite = np.isfinite(group_values).all()
            method: Literal["linear", "inverted_cdf"] = "linear" if is_finite else "inverted_cdf"
            expected = np.quantile(group_values, ORDERS, method=method)
        np.testing.assert_allclose(quantiles[:, group], expected, rtol=1e-14)


def test_later_values_are_the_largest_and_nothing_is_interpolated_to_them():
    values = np.array([np.inf, 3.0, np.nan, 1.0, np.inf, 2.0])
    assert quantiles_of(values, (0.0, 0.5, 0.6, 0.61, 1.0)) == [1.0, 3.0, 3.0, np.inf, np.inf]
    assert all(np.isnan(quantiles_of(np.array([np.nan, np.nan]), ORDERS)))
