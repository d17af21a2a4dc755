"""A folder that one process at a time may write to, or several that share the work."""

import errno
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from rbstab.store.errors import StoreError

LOCK = ".lock"
"""The file that is locked. It stays where it is; its being there means nothing."""

TRIES = 6
"""Whoever asks whether a lock is held holds it for an instant: a refusal must last."""

PAUSE = 0.02
"""s between two tries."""

UNKNOWN = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.EINVAL)
"""What file systems say that know no locks."""


class FolderInUseError(StoreError):
    """Another process is writing to the folder."""


@contextmanager
def locked(folder: Path, name: str = LOCK, *, shared: bool = False) -> Iterator[bool]:
    """Holds a lock of a folder; the operating system lets it go when the process ends, however.

    Args:
        folder: The folder.
        name: Of the file that stands for the lock.
        shared: Let others share it, but none have it alone. Windows knows no such lock.

    Yields:
        Whether it is held: some network file systems know no locks, and nobody is refused there.

    Raises:
        FolderInUseError: Somebody else holds it.
        StoreError: The folder cannot be written.
    """
    try:
        # For a shared lock, NFS wants a file that can be read.
        file = (folder / name).open("a+b")
    except OSError as error:
        raise StoreError(f"{folder} cannot be written: {error.strerror or error}") from error
    with file:
        for left in reversed(range(TRIES)):
            try:
                held = _lock(file, shared=shared)
                break
            except BlockingIOError as error:
                if not left:
                    raise FolderInUseError(f"{folder} is in use by another process") from error
                time.sleep(PAUSE)
        yield held


def is_locked(folder: Path, name: str = LOCK) -> bool:
    """Whether some process has a lock of a folder for itself alone."""
    try:
        with (folder / name).open("r+b") as file:
            _lock(file, shared=sys.platform != "win32")
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


if sys.platform == "win32":

    def _lock(file: BinaryIO, *, shared: bool) -> bool:
        import msvcrt

        if shared:
            return False
        file.seek(0)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError as error:
            raise BlockingIOError(str(error)) from error
        return True

else:

    def _lock(file: BinaryIO, *, shared: bool) -> bool:
        import fcntl

        try:
            fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except PermissionError as error:
            # What some systems say of a lock that is held.
            raise BlockingIOError(str(error)) from error
        except OSError as error:
            if error.errno not in UNKNOWN:
                raise
            return False
        return True
