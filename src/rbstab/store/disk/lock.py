"""The lock of a folder: one process holds it alone, or several share it."""

import errno
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from rbstab.store.disk.paths import store_errors
from rbstab.store.errors import StoreError

LOCK_FILE = ".lock"
"""The lock file. It is never removed. Its existence means nothing; only the lock does."""

MAX_ATTEMPTS = 6
"""The number of attempts to lock. A process that only tests the lock also holds it briefly."""

RETRY_INTERVAL = 0.02
"""Time between two attempts, s."""

READ_ONLY_ERRORS = (errno.EROFS, errno.EACCES, errno.EPERM)
"""Errors of opening a file for writing in a folder that this process may only read."""

UNSUPPORTED_ERRORS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.EINVAL)
"""Errors of file systems without locks."""


class FolderInUseError(StoreError):
    """Another process is using the folder."""


@contextmanager
def locked(folder: Path, *, shared: bool = False) -> Iterator[None]:
    """Return a context that holds the lock of a folder, where the system has one.

    The system releases the lock when the process ends, for any reason. Some network file systems
    have no locks, Windows has no shared ones, and in a folder that this process may not even read
    there is nothing to lock.

    Args:
        folder: The folder.
        shared: Whether other processes may share the lock.

    Raises:
        FolderInUseError: Another process holds the lock, or has just renamed the folder.
        StoreError: The lock file cannot be opened or locked.
    """
    with store_errors(folder, "written"):
        file = _open_lock_file(folder / LOCK_FILE)
    if file is None:
        yield
        return
    try:
        for _ in range(MAX_ATTEMPTS):
            with store_errors(folder, "locked"), suppress(BlockingIOError):
                try_lock(file, shared=shared)
                break
            time.sleep(RETRY_INTERVAL)
        else:
            raise FolderInUseError(f"{folder} is in use by another process. Wait until it ends")
        if not _is_in(file, folder):
            # Its owner has renamed the folder, as `--force` does.
            raise FolderInUseError(f"{folder} was just moved by another process. Try again")
        yield
    finally:
        # Nothing was written to it: an error of closing means nothing, and the lock is released.
        with suppress(OSError):
            file.close()


def _open_lock_file(path: Path) -> BinaryIO | None:
    """Open a lock file to read and write, or else to read; None if it cannot be created."""
    try:
        # NFS needs a readable file for a shared lock, and a writable one for an exclusive lock.
        return path.open("a+b")
    except OSError as error:
        if error.errno not in READ_ONLY_ERRORS:
            raise
    # So a finished sweep can be read in a folder that cannot be written. Without a file there is
    # nothing to lock.
    with suppress(FileNotFoundError, PermissionError):
        return path.open("rb")
    return None


def _is_in(file: BinaryIO, folder: Path) -> bool:
    """Return whether an open lock file is still that of a folder."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), (folder / LOCK_FILE).stat())
    except FileNotFoundError:
        return False


def is_locked(folder: Path) -> bool:
    """Whether a process holds the lock of a folder, alone or with others."""
    try:
        with (folder / LOCK_FILE).open("r+b") as file:
            try_lock(file)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


if sys.platform == "win32":

    def try_lock(file: BinaryIO, *, shared: bool = False) -> bool:
        """Lock a file until it is closed; see the version for other systems."""
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

    def try_lock(file: BinaryIO, *, shared: bool = False) -> bool:
        """Lock a file until it is closed.

        Args:
            file: The file.
            shared: Whether other processes may share the lock. Windows has no shared locks.

        Returns:
            True if the lock is held, False if the file system has no locks.

        Raises:
            BlockingIOError: Another process holds the lock.
            OSError: The file cannot be locked.
        """
        import fcntl

        try:
            fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except PermissionError as error:
            # Some systems raise this error if another process holds the lock.
            raise BlockingIOError(str(error)) from error
        except OSError as error:
            if error.errno not in UNSUPPORTED_ERRORS:
                raise
            return False
        return True
