from functools import partial

import pytest
from support.made_sweeps import write_sweep

from rbstab.report.sweeps.members import read_members


@pytest.fixture
def made(tmp_path):
    """Writes a sweep of made up members; see `write_sweep`."""
    return partial(write_sweep, tmp_path / "results" / "made" / "sweep.h5")


@pytest.fixture
def members(made):
    """The members of such a sweep."""
    return lambda *arguments, **keys: read_members(made(*arguments, **keys).path)
