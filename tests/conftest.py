"""Settings and fixtures of all tests."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import settings
from support.tiers import longest_first, mark_by_time, read_seconds

# No deadline: on a busy machine a single example can take long.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Iterator[None]:
    """Mark tests before pytest selects them by their markers, and order those that it selects."""
    seconds = read_seconds()
    mark_by_time(items, seconds)
    yield
    longest_first(items, seconds)


@pytest.fixture(params=range(4), ids="seed {}".format)
def rng(request):
    """Return a random generator; each test that uses it runs with four seeds."""
    return np.random.default_rng(request.param)
