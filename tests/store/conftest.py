"""The file permissions mask, restored after each test."""

import os

import pytest


@pytest.fixture
def umask():
    """A function that sets the permissions mask of new files for one test."""
    old = os.umask(0o022)
    yield os.umask
    os.umask(old)
