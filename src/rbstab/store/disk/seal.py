"""The seal: a digest at the end of a file, which shows whether the file was changed.

HDF5 does not detect a number that was changed on disk, and may hang on a damaged heap. So the seal
is checked before HDF5 reads the file. HDF5 ignores bytes after its own end.
"""

import hashlib
from pathlib import Path
from typing import BinaryIO

from rbstab.store.disk.regular_file import open_regular, read_regular
from rbstab.store.errors import NotAResultError, StoreError

_SIGNATURE = b"\nrbstab sha256 "
_SIGNATURE_PARTS = [_SIGNATURE[:length] for length in range(2, len(_SIGNATURE))]
SEAL_SIZE = len(_SIGNATURE) + 64 + 1

_BLOCK = 1 << 20

_DAMAGED_MESSAGE = "{} is damaged: its content does not match its digest"


def add_seal(content: bytes) -> bytes:
    """Return content with its seal appended."""
    return content + format_seal(hashlib.sha256(content).hexdigest())


def format_seal(digest: str) -> bytes:
    """Return the seal with this SHA-256, in hexadecimal."""
    return _SIGNATURE + digest.encode() + b"\n"


def read_seal(path: Path) -> str | None:
    """Return the digest in the seal of a file, without checking it; None without a seal.

    Raises:
        StoreError: The file cannot be read.
    """
    try:
        with open_regular(path) as file:
            file.seek(max(0, file.seek(0, 2) - SEAL_SIZE))
            end = file.read()
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error
    digest = end[len(_SIGNATURE) : -1]
    complete = end == _SIGNATURE + digest + b"\n" and len(end) == SEAL_SIZE
    return digest.decode("ascii", "replace") if complete else None


def seal_digest(content: bytes) -> str:
    """Return the digest in the seal of sealed content, in hexadecimal."""
    return content[-65:-1].decode()


def read_sealed(path: Path) -> tuple[bytes, str]:
    """Read a file and check its seal; return the content before the seal, and the digest.

    Raises:
        NotAResultError: The file is damaged.
        StoreError: The file cannot be read.
    """
    content = read_regular(path)
    if len(content) < SEAL_SIZE or add_seal(content[:-SEAL_SIZE]) != content:
        raise NotAResultError(_DAMAGED_MESSAGE.format(path))
    return content[:-SEAL_SIZE], seal_digest(content)


def has_seal(path: Path) -> bool:
    """Whether a file ends with a seal, valid or not, or with a part of a seal.

    Raises:
        StoreError: The file cannot be read.
    """
    try:
        with open_regular(path) as file:
            size = file.seek(0, 2)
            file.seek(max(0, size - SEAL_SIZE))
            end = file.read()
            return _SIGNATURE in end or any(map(end.endswith, _SIGNATURE_PARTS))
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error


def check_seal(path: Path) -> None:
    """Read a file and check its seal.

    Raises:
        NotAResultError: The file is damaged.
        StoreError: The file cannot be read.
    """
    try:
        with open_regular(path) as file:
            size = file.seek(0, 2) - SEAL_SIZE
            file.seek(0)
            intact = size >= 0 and _compute_seal(file, size) == file.read()
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error
    if not intact:
        raise NotAResultError(_DAMAGED_MESSAGE.format(path))


def _compute_seal(file: BinaryIO, size: int) -> bytes:
    """Read the next `size` bytes and return their seal."""
    digest = hashlib.sha256()
    while size > 0:
        block = file.read(min(size, _BLOCK))
        if not block:
            break
        digest.update(block)
        size -= len(block)
    return format_seal(digest.hexdigest())
