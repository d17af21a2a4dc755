"""Settings and fixtures of all tests."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings
from support import missing_heyoka, time_left
from support.tiers import SHORTEST_FIRST, mark_by_time, order_files, read_seconds

# No deadline: on a busy machine a single example can take long.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")


def pytest_addoption(parser):
    """Add the options for the time of a test run and for its order."""
    time_left.add_option(parser)
    parser.addoption(SHORTEST_FIRST, action="store_true", help="begin with the quickest files")


def pytest_configure(config):
    """Set the end of a test run."""
    time_left.set_end(config)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup():
    """Skip a test, before its fixtures are made, if the time of the test run is over.

    Skip it too if its fixtures need heyoka where that is not installed.
    """
    time_left.skip_if_over()
    with missing_heyoka.skipped():
        yield


@pytest.hookimpl(wrapper=True, trylast=True)
def pytest_runtest_call():
    """Skip a test that needs heyoka where it is not installed."""
    with missing_heyoka.skipped():
        yield


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Mark tests before pytest selects them by their markers, and order those that it selects."""
    seconds = read_seconds()
    mark_by_time(items, seconds)
    yield
    if config.getoption(time_left.OPTION) is None:
        order_files(items, seconds, config.getoption(SHORTEST_FIRST))
    else:
        time_left.shuffle_files(items, time_left.commit_of(Path(__file__).parent))


@pytest.fixture(params=range(4), ids="seed {}".format)
def rng(request):
    """Return a random generator; each test that uses it runs with four seeds."""
    return np.random.default_rng(request.param)
