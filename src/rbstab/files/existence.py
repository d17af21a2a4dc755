"""Whether a path exists, with the errors of the disk.

From Python 3.14 on, `Path.exists` is False for every error: a file on a disk that does not answer
would count as absent, and could be replaced.
"""

import errno
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
    try:
        path.stat()
    except OSError as error:
        if error.errno in _ABSENT or getattr(error, "winerror", None) in _ABSENT_ON_WINDOWS:
            return False
        raise
    except ValueError:  # no name has a null character
        return False
    return True
