"""Tests without heyoka, as on macOS and Windows: those that need it are skipped there.

Where heyoka is installed, nothing here has an effect.
"""

import importlib.util
from contextlib import contextmanager

import pytest

from rbstab.integrate.engines import EngineMissingError

INSTALLED = importlib.util.find_spec("heyoka") is not None

REASON = "heyoka is not installed"

NEEDED = pytest.mark.skipif(not INSTALLED, reason=REASON)
"""The mark of a test that needs heyoka and does not end with the error that says so."""


@contextmanager
def skipped():
    """Skip the test if heyoka is not installed and the block ends with the error that says so."""
    try:
        yield
    except (EngineMissingError, ModuleNotFoundError) as error:
        if INSTALLED or not _is_of_heyoka(error):
            raise
        pytest.skip(REASON)


def _is_of_heyoka(error):
    return isinstance(error, EngineMissingError) or (error.name or "").startswith("heyoka")
