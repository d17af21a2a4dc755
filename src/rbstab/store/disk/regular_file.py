"""Reading regular files only; errors become store errors."""

import os
from pathlib import Path
from typing import BinaryIO

from rbstab.files import regular_file
from rbstab.store.errors import NotAResultError, StoreError


def open_regular(path: Path) -> BinaryIO:
    """Open a file for reading bytes.

    Raises:
        StoreError: The file cannot be opened, or is a folder, a pipe, a socket or a device.
    """
    try:
        return regular_file.open_regular(path)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StoreError(f"{path} cannot be read: {reason}") from error


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
