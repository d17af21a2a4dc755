import numpy as np
import pytest


@pytest.fixture(params=range(4), ids="seed {}".format)
def rng(request):
    return np.random.default_rng(request.param)
