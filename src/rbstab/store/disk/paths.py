"""Paths before they are used, when the file system may return an error; and reading small files."""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from rbstab.files.paths import exists, is_dir, is_file, open_regular
from rbstab.store.errors import NotAResultError, StoreError

Identity = tuple[int, ...]
"""Numbers that change when a file changes."""


def identity_of(status: os.stat_result) -> Identity:
    """Return the identity of a file."""
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns


@contextmanager
def store_errors(path: Path, what: str) -> Iterator[None]:
    """Return a context in which an error of the system means that a path cannot be read or written.

    Raises:
        StoreError: The path cannot be `what`, with the system's reason.
    """
    try:
        yield
    except (OSError, ValueError, MemoryError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StoreError(f"{path} cannot be {what}: {reason}") from error


def _told(test: Callable[[Path], bool]) -> Callable[[Path], bool]:
    """Return a test of a path that raises a StoreError where the path cannot be tested."""

    def told(path: Path) -> bool:
        with store_errors(path, "read"):
            return test(path)

    return told


path_exists, path_is_file, path_is_dir = map(_told, (exists, is_file, is_dir))
"""Whether a path leads to a file or folder, to a regular file, or to a folder.

Raises:
    StoreError: The path cannot be tested: its folder is not accessible, or its name is too long.
"""


@contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """Return a context with a file open for reading bytes.

    Raises:
        StoreError: The file cannot be read, or is a folder, a pipe, a socket or a device.
    """
    with store_errors(path, "read"), open_regular(path) as file:
        yield file


def read_regular(path: Path, limit: int | None = None) -> bytes:
    """Return the bytes of a file.

    Args:
        path: The file.
        limit: The largest size to read, bytes.

    Raises:
        NotAResultError: The file is larger than `limit`.
        StoreError: The file cannot be read, or is not a regular file.
    """
    with opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        if limit is not None and size > limit:
            raise NotAResultError(
                f"{path} has {size / 1e6:.3g} MB, more than rbstab ever writes to such a file"
            )
        return file.read()


def check_writable(path: Path) -> None:
    """Check that a file can be written, so that an error comes before the work and not after it.

    Nothing is written or created. Some errors show only while writing, such as a full disk.

    Args:
        path: The file. It may exist, and its folders may be missing.

    Raises:
        StoreError: The name is too long, a folder is not writable, or the path is not a file.
    """
    with store_errors(path, "written"):
        if exists(path) and not is_file(path):
            kind = "folder" if is_dir(path) else "pipe, a device or a socket"
            raise OSError(f"it is a {kind}, not a file")
        folder, missing = path.parent, [] if exists(path) else [path.name]
        while not exists(folder):
            missing.append(folder.name)
            folder = folder.parent
        for name in missing:
            # Only a folder that exists tells whether a name is too long.
            with suppress(FileNotFoundError):
                (folder / name).lstat()
                # The other names belong into folders that are missing too.
                if name == missing[-1]:
                    raise OSError(f"{name} is a link to a missing file or folder")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise OSError(f"{folder} is not writable")


def check_folder(folder: Path) -> None:
    """Check that files can be written in a folder, so that an error comes before the work.

    Tried, and not only asked: for an administrator every folder seems writable. Nothing remains.

    Args:
        folder: The folder. It need not exist; then the nearest one above it is tried.

    Raises:
        StoreError: It is not a folder, or no file can be made in it.
    """
    with store_errors(folder, "written"):
        existing = folder.absolute()
        while not exists(existing) and existing != existing.parent:
            existing = existing.parent
        with tempfile.TemporaryFile(dir=existing):
            pass
