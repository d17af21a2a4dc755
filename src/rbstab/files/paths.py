"""Whether a path exists, and as what, with the errors of the disk; opening regular files only.

From Python 3.14 on, `Path.exists`, `is_file` and `is_dir` are False for every error: a file on a
disk that does not answer would count as absent, and could be replaced. Reading a pipe or a device
may wait for ever, or never end.
"""

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

_ABSENT = (errno.ENOENT, errno.ENOTDIR, errno.EBADF, errno.ELOOP)
"""Errors of paths that do not exist."""

_ABSENT_ON_WINDOWS = (21, 123, 1921)
"""Windows: the drive is empty, the name is not allowed, a link leads nowhere."""


def exists(path: Path) -> bool:
    """Whether a file or folder exists at this path; a link that leads nowhere does not.

    Raises:
        OSError: It is not known: a folder is not accessible, the name is too long, or the disk
            reports an error.
    """
    return _status(path) is not None


def is_file(path: Path) -> bool:
    """Whether a path leads to a regular file.

    Raises:
        OSError: As by `exists`.
    """
    status = _status(path)
    return status is not None and stat.S_ISREG(status.st_mode)


def is_dir(path: Path) -> bool:
    """Whether a path leads to a folder.

    Raises:
        OSError: As by `exists`.
    """
    status = _status(path)
    return status is not None and stat.S_ISDIR(status.st_mode)


def _status(path: Path) -> os.stat_result | None:
    """Return the status of a file or folder; None if it does not exist."""
    try:
        return path.stat()
    except OSError as error:
        if error.errno in _ABSENT or getattr(error, "winerror", None) in _ABSENT_ON_WINDOWS:
            return None
        raise
    except ValueError:  # no name has a null character
        return None


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file for reading bytes.

    Raises:
        IsADirectoryError: The path is a folder.
        OSError: The path is a pipe, a device or a socket, or the file cannot be opened.
        ValueError: The path has a null character.
    """
    mode = path.stat().st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode):
        kind = "a pipe" if stat.S_ISFIFO(mode) else "a device or a socket"
        raise OSError(errno.EINVAL, f"it is {kind}, not a file", str(path))
    return path.open("rb")
