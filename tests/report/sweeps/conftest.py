"""Sweep files with made up members, and readers of them."""

from functools import partial

import pytest
from support.made_sweeps import write_sweep

from rbstab.report.sweeps.members import read_members


@pytest.fixture
def made(tmp_path):
    """A function that writes a sweep of made up members; see `write_sweep`."""
    return partial(write_sweep, tmp_path / "results" / "made" / "members.h5")


@pytest.fixture
def members(made):
    """A function that writes such a sweep and returns its members."""
    return lambda *arguments, **keys: read_members(made(*arguments, **keys).path)
