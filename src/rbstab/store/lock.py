"""A folder that one process at a time may write to."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from rbstab.store.errors import StoreError

LOCK = ".lock"
"""The file that is locked. It stays where it is; its being there means nothing."""


class FolderInUseError(StoreError):
    """Another process is writing to the folder."""


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Holds the lock of a folder; the operating system lets it go when the process ends, however.

    Raises:
        FolderInUseError: Somebody else holds it.
        StoreError: The folder cannot be written.
    """
    try:
        file = (folder / LOCK).open("ab")
    except OSError as error:
        raise StoreError(f"{folder} cannot be written: {error.strerror or error}") from error
    with file:
        try:
            _lock(file)
        except BlockingIOError as error:
            raise FolderInUseError(f"{folder} is in use by another process") from error
        yield


def is_locked(folder: Path) -> bool:
    """Whether some process is writing to a folder."""
    try:
        with (folder / LOCK).open("r+b") as file:
            _lock(file)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


if sys.platform == "win32":

    def _lock(file: BinaryIO) -> None:
        import msvcrt

        file.seek(0)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError as error:
            raise BlockingIOError(str(error)) from error

else:

    def _lock(file: BinaryIO) -> None:
        import fcntl

        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except PermissionError as error:
            # What some systems say of a lock that is held.
            raise BlockingIOError(str(error)) from error
