import os

import pytest


@pytest.fixture
def umask():
    """Sets the mask of permissions of new files for one test."""
    old = os.umask(0o022)
    yield os.umask
    os.umask(old)
