"""Opening regular files only: a pipe or a device could block for ever, or never end."""

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

from rbstab.store.errors import NotAResultError, StoreError


def open_regular(path: Path) -> BinaryIO:
    """Open a file for reading bytes.

    Raises:
        StoreError: The file cannot be opened, or is a folder, a pipe, a socket or a device.
    """
    try:
        # Opened first and tested afterwards, so that no other file can take its place in between.
        # Without O_NONBLOCK, opening a pipe waits for a writer.
        flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        descriptor = os.open(path, flags)
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error
    mode = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(mode):
        os.close(descriptor)
        reason = os.strerror(errno.EISDIR) if stat.S_ISDIR(mode) else "it is a pipe or a device"
        raise StoreError(f"{path} cannot be read: {reason}")
    return open(descriptor, "rb")  # noqa: PTH123 (`Path.open` takes no descriptor)


def read_regular(path: Path, limit: int | None = None) -> bytes:
    """Return the bytes of a file.

    Args:
        path: The file.
        limit: The largest size to read, bytes.

    Raises:
        NotAResultError: The file is larger than `limit`.
        StoreError: The file cannot be read, or is not a regular file.
    """
    try:
        with open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
            if limit is not None and size > limit:
                raise NotAResultError(
                    f"{path} has {size / 1e6:.3g} MB, more than rbstab ever writes to such a file"
                )
            return file.read()
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error
