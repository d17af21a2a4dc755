"""A system that does not rename or remove open files, as Windows: a fake for other systems."""

import errno
import os
import sys
from contextlib import suppress
from pathlib import Path

import psutil

from rbstab.store.disk import atomic

DESCRIPTORS = "/dev/fd"
"""The open files of this process."""

NAMES = {"rename": 2, "replace": 2, "unlink": 1, "remove": 1}
"""Functions of `os` that change a name, and how many of their first arguments must be closed."""


def open_descriptors():
    """Return how many files this process has open."""
    process = psutil.Process()
    return int(process.num_handles() if sys.platform == "win32" else process.num_fds())


def is_open(path):
    """Return whether this process has the file of a path open."""
    for descriptor in os.listdir(DESCRIPTORS):  # noqa: PTH208 (Path would open files itself)
        with suppress(OSError):
            if os.path.samestat(os.fstat(int(descriptor)), Path(path).lstat()):
                return True
    return False


def keep_open_files(monkeypatch):
    """Let `os` refuse to rename, replace and remove open files, as Windows does.

    A hard link of an open file is allowed there.
    """

    def refusing(call, count):
        def refuse(*paths, **options):
            for path in paths[:count]:
                # A descriptor of a folder makes the path relative; rbstab uses none.
                if "dir_fd" not in options and is_open(path):
                    raise PermissionError(errno.EACCES, "it is open in a process", str(path))
            call(*paths, **options)

        return refuse

    for name, count in NAMES.items():
        monkeypatch.setattr(os, name, refusing(getattr(os, name), count))
    monkeypatch.setattr(atomic, "RENAMES_OPEN_FILES", False)
