"""Settings and fixtures of all tests."""

import numpy as np
import pytest
from hypothesis import settings

# No deadline: on a busy machine a single example can take long.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")


@pytest.fixture(params=range(4), ids="seed {}".format)
def rng(request):
    """Return a random generator; each test that uses it runs with four seeds."""
    return np.random.default_rng(request.param)
