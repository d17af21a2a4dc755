"""By what a file is known that was read before."""

import os
import time

Identity = tuple[int, ...]
"""Numbers that change when a file changes."""

MIN_AGE = 2.0
"""s; a file that was changed less than this time ago may change again with the same time stamp."""


def identity_of(found: os.stat_result) -> Identity:
    """Return the identity of a file."""
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def is_old(found: os.stat_result) -> bool:
    """Return whether a file cannot change again without a change of its identity."""
    return time.time() - found.st_mtime > MIN_AGE
