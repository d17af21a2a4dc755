"""A digest at the end of a file by which it is known to be what was written.

HDF5 does not notice a number that has changed on the disk, and can fail to return from a damaged
heap. The seal is looked at before HDF5 sees the file, and HDF5 does not mind what stands behind its
end.
"""

import hashlib
from pathlib import Path
from typing import BinaryIO

from rbstab.store.errors import NotAResultError, StoreError

_MARK = b"\nrbstab sha256 "
SEAL_SIZE = len(_MARK) + 64 + 1

_BLOCK = 1 << 20

_DAMAGED = "{} is damaged: it is not what was written (by its digest)"


def seal(path: Path) -> None:
    """Puts the seal behind what a file holds.

    Raises:
        OSError: The disk is full, and the like.
    """
    with path.open("r+b") as file:
        size = file.seek(0, 2)
        file.seek(0)
        file.write(_seal_of(file, size))


def sealed(content: bytes) -> bytes:
    """Some content with its seal."""
    return content + seal_line(hashlib.sha256(content).hexdigest())


def seal_line(digest: str) -> bytes:
    """The seal of content with this SHA-256, in hexadecimal, which somebody has taken already."""
    return _MARK + digest.encode() + b"\n"


def stated_seal(path: Path) -> str | None:
    """The digest that a file says to have, by its end alone; None where no seal is there.

    Raises:
        StoreError: It cannot be read.
    """
    try:
        with path.open("rb") as file:
            file.seek(max(0, file.seek(0, 2) - SEAL_SIZE))
            end = file.read()
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error
    digest = end[len(_MARK) : -1]
    whole = end == _MARK + digest + b"\n" and len(end) == SEAL_SIZE
    return digest.decode("ascii", "replace") if whole else None


def digest_in(content: bytes) -> str:
    """The digest in the seal of some sealed content, in hexadecimal."""
    return content[-65:-1].decode()


def unsealed(path: Path) -> tuple[bytes, str]:
    """What a file holds before its seal, and the digest in that.

    Raises:
        NotAResultError: It is not what was written.
        StoreError: It cannot be read.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error
    if len(content) < SEAL_SIZE or sealed(content[:-SEAL_SIZE]) != content:
        raise NotAResultError(_DAMAGED.format(path))
    return content[:-SEAL_SIZE], digest_in(content)


def has_seal(path: Path) -> bool:
    """Whether a file ends with a seal, right or wrong, or with what is left of one.

    Raises:
        StoreError: It cannot be read.
    """
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            file.seek(max(0, size - SEAL_SIZE))
            end = file.read()
            return _MARK in end or any(end.endswith(_MARK[:n]) for n in range(2, len(_MARK)))
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error


def check_seal(path: Path) -> None:
    """Reads a file and checks its seal.

    Raises:
        NotAResultError: It is not what was written.
        StoreError: It cannot be read.
    """
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2) - SEAL_SIZE
            file.seek(0)
            intact = size >= 0 and _seal_of(file, size) == file.read()
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error
    if not intact:
        raise NotAResultError(_DAMAGED.format(path))


def _seal_of(file: BinaryIO, size: int) -> bytes:
    """The seal of the next `size` bytes, which are read."""
    digest = hashlib.sha256()
    while size > 0:
        block = file.read(min(size, _BLOCK))
        if not block:
            break
        digest.update(block)
        size -= len(block)
    return seal_line(digest.hexdigest())
