import numpy as np
import pytest
from hypothesis import settings

# No test asserts a time: on a busy machine an example may take any.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")


@pytest.fixture(params=range(4), ids="seed {}".format)
def rng(request):
    return np.random.default_rng(request.param)
