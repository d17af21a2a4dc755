"""Tests that are not started when the time of a test run is over; the summary counts them."""

import hashlib
import os
import subprocess
import time

import pytest

from support.tiers import names_of

OPTION = "--minutes"

END = "RBSTAB_TESTS_END"
"""The variable with the time after which no test is started, s; the worker processes inherit it."""

OVER = f"not started: the time of {OPTION} was over"


def add_option(parser):
    """Add the option for the time of a test run."""
    text = "start no test after this many minutes, and take the files in an order of this commit"
    parser.addoption(OPTION, type=float, help=text)


def set_end(config):
    """Set the end of a test run; its worker processes inherit it."""
    minutes = config.getoption(OPTION)
    if minutes is not None and not hasattr(config, "workerinput"):
        os.environ[END] = str(time.time() + 60.0 * minutes)


def skip_if_over():
    """Skip a test if the time of the test run is over."""
    if time.time() > float(os.environ.get(END, "inf")):
        pytest.skip(OVER)


def shuffle_files(items, commit):
    """Order files by digests with the commit: each commit starts other tests before the end."""

    def digest(item):
        file, _ = names_of(item.nodeid)
        return hashlib.sha256(f"{commit} {file}".encode()).digest()

    items.sort(key=digest)


def commit_of(folder):
    """Return the commit of a folder; an empty text without git."""
    command = ["git", "-C", str(folder), "rev-parse", "HEAD"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return ""
    return done.stdout.strip()
