"""Folder locks: only one process, or only the processes that share the lock, may write."""

import errno
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

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
    """Another process is writing to the folder."""


@contextmanager
def locked(folder: Path, name: str = LOCK_FILE, *, shared: bool = False) -> Iterator[bool]:
    """Return a context that holds a lock of a folder.

    The operating system releases the lock when the process ends, for any reason.

    Args:
        folder: The folder.
        name: The name of the lock file.
        shared: Whether other processes may share the lock. Windows has no shared locks.

    Yields:
        True if the lock is held. False if the file system has no locks (some network file systems),
        for a shared lock on Windows, and if this process cannot write to the folder.

    Raises:
        FolderInUseError: Another process holds the lock.
        StoreError: The lock file cannot be opened or locked.
    """
    try:
        file = _open_lock_file(folder / name)
    except OSError as error:
        raise StoreError(f"{folder} cannot be written: {error.strerror or error}") from error
    if file is None:
        yield False
        return
    try:
        yield _lock(file, folder, shared=shared) and file.writable()
    finally:
        # Nothing was written to it: an error of closing means nothing, and the lock is released.
        with suppress(OSError):
            file.close()


def _lock(file: BinaryIO, folder: Path, *, shared: bool) -> bool:
    """Lock the lock file of a folder; return False if the file system has no locks.

    Raises:
        FolderInUseError: Another process holds the lock.
        StoreError: The file cannot be locked.
    """
    for _ in range(MAX_ATTEMPTS):
        try:
            return try_lock(file, shared=shared)
        except BlockingIOError:
            time.sleep(RETRY_INTERVAL)
        except OSError as error:
            raise StoreError(f"{folder} cannot be locked: {error.strerror or error}") from error
    raise FolderInUseError(f"{folder} is in use by another process")


def _open_lock_file(path: Path) -> BinaryIO | None:
    """Open a lock file for reading and writing; in a folder that cannot be written, for reading.

    So a finished sweep can be read in such a folder.

    Returns:
        The file; None if it cannot be created, so that there is nothing to lock.

    Raises:
        OSError: The folder cannot be used.
    """
    try:
        # NFS needs a readable file for a shared lock, and a writable one for an exclusive lock.
        return path.open("a+b")
    except OSError as error:
        if error.errno not in READ_ONLY_ERRORS:
            raise
    with suppress(FileNotFoundError, PermissionError):
        return path.open("rb")
    return None


def is_locked(folder: Path, name: str = LOCK_FILE) -> bool:
    """Whether a process holds an exclusive lock of a folder."""
    try:
        with (folder / name).open("r+b") as file:
            try_lock(file, shared=sys.platform != "win32")
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
