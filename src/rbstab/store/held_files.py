"""HDF5 files that another part of this program, or another program, holds open for writing."""

import hashlib
from pathlib import Path

from rbstab.store.disk.regular_file import open_regular
from rbstab.store.disk.seal import SEAL_SIZE, check_seal, format_seal
from rbstab.store.errors import NotAResultError, StoreError

_MARK = 20
"""The byte of the mark, in the superblock of version 0, which this program writes."""

_BLOCK = 1 << 20


def check_unchanged(path: Path) -> None:
    """Check the seal of an HDF5 file. A file that is open for writing is not called damaged.

    HDF5 marks a file while it is open for writing, as `h5py.File(path, "a")` opens it. The mark
    breaks the seal even if nothing is written, and goes away when the file is closed.

    Raises:
        NotAResultError: The file was changed.
        StoreError: It is open for writing, or cannot be read.
    """
    try:
        check_seal(path)
    except NotAResultError as error:
        if not _is_open_for_writing(path):
            raise
        raise StoreError(
            f"{path} is open for writing, here or in another program, or was never closed by it. "
            "Close it, or open it for reading only"
        ) from error


def _is_open_for_writing(path: Path) -> bool:
    """Whether the seal is right but for the mark of HDF5."""
    digest = hashlib.sha256()
    try:
        with open_regular(path) as file:
            left = file.seek(0, 2) - SEAL_SIZE
            file.seek(0)
            start = bytearray(file.read(_MARK + 1))
            if left <= len(start) or start[-1] != 1:
                return False
            start[-1] = 0
            digest.update(start)
            left -= len(start)
            while left > 0 and (block := file.read(min(left, _BLOCK))):
                digest.update(block)
                left -= len(block)
            return file.read() == format_seal(digest.hexdigest())
    except (OSError, ValueError):
        return False
