"""Whether a path exists, and as what, with the errors of the disk.

From Python 3.14 on, `Path.exists`, `is_file` and `is_dir` are False for every error: a file on a
disk that does not answer would count as absent, and could be replaced.
"""

import errno
import os
import stat
from pathlib import Path

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
