"""The seal: the last line of a file, with a digest of all before it.

It shows whether a file is as it was meant: a digest is made of what is written, not of what is read
back. What stands before the seal is the content of the file, and a line of JSON, the index, which
says what the content is. So a file is read without the library of its format.
"""

import hashlib
import json
import os
import re
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from rbstab.store.disk.atomic import write_all
from rbstab.store.disk.paths import Identity, identity_of
from rbstab.store.errors import NewerSchemaError, NotAResultError

FORMAT = 1
"""The version of the format of files that this program writes, and the newest that it reads."""

MAX_INDEX_BYTES = 64 << 20
"""The largest index."""

MIN_AGE = 2.0
"""s; a file that was changed less than this time ago may change again with the same time stamp."""

_LINE = b"\nrbstab format %03d sha256 %s\n"
SEAL_SIZE = len(_LINE % (FORMAT, b"0" * 64))
_SEAL = re.compile(
    rb"\nrbstab format (?P<format>(?!000)[0-9]{3}) sha256 (?P<digest>[0-9a-f]{64})\n"
)
_OLD_SEAL = re.compile(rb"\nrbstab sha256 [0-9a-f]{64}\n\Z")

_BLOCK = 1 << 20

_unchanged: set[Identity] = set()
"""The files that this process has compared with their seals."""


def write_sealed(
    file: BinaryIO, content: Iterable[memoryview], index: Mapping[str, Any]
) -> tuple[str, int]:
    """Write a content in ascending order, its index and its seal; return the digest and the size.

    Args:
        file: The file, open for writing.
        content: The content, in pieces.
        index: What the index tells of the content, as plain data.

    Raises:
        OSError: A byte cannot be written, for example because the disk is full.
    """
    line = memoryview(b"\n" + json.dumps(index, ensure_ascii=False).encode())
    digest, size = hashlib.sha256(), SEAL_SIZE
    for piece in (*content, line):
        for begin in range(0, len(piece), _BLOCK):
            block = piece[begin : begin + _BLOCK]
            digest.update(block)
            write_all(file, block)
        size += len(piece)
    write_all(file, _LINE % (FORMAT, digest.hexdigest().encode()))
    return digest.hexdigest(), size


def read_seal(path: Path, file: BinaryIO) -> str:
    """Return the digest in the seal of a file, without checking it.

    Raises:
        NotAResultError: It has no seal.
        NewerSchemaError: It was written by a newer rbstab.
        OSError: It cannot be read.
    """
    file.seek(max(0, file.seek(0, 2) - SEAL_SIZE))
    end = file.read()
    match = _SEAL.fullmatch(end)
    if match is not None:
        if int(match["format"]) > FORMAT:
            raise NewerSchemaError(f"{path} was written by a newer rbstab; update rbstab")
        return match["digest"].decode()
    if _OLD_SEAL.search(end):
        raise _refusal(path, "was made before the first release; run its config again")
    raise _refusal(
        path,
        "has no seal of rbstab: it is no result, or it was damaged or changed by another program",
    )


def _refusal(path: Path, reason: str) -> NotAResultError:
    return NotAResultError(f"{path} {reason}. Without this check, h5py may still read it")


def checked_seal(path: Path, file: BinaryIO) -> str:
    """Compare a file with its seal, but only once if it cannot change unnoticed.

    Returns:
        The digest.

    Raises:
        NotAResultError: It has no seal, or not its own.
        NewerSchemaError: It was written by a newer rbstab.
        OSError: It cannot be read.
    """
    digest, status, content_hash = read_seal(path, file), os.fstat(file.fileno()), hashlib.sha256()
    if identity_of(status) in _unchanged:
        return digest
    left = file.seek(0, 2) - SEAL_SIZE
    file.seek(0)
    while left > 0 and (block := file.read(min(left, _BLOCK))):
        content_hash.update(block)
        left -= len(block)
    if content_hash.hexdigest() != digest:
        raise _refusal(
            path, "is damaged: its content does not match its digest (or it is open for writing)"
        )
    if time.time() - status.st_mtime > MIN_AGE:
        _unchanged.add(identity_of(status))
    return digest


def read_index(path: Path, file: BinaryIO) -> tuple[dict[str, Any], int]:
    """Return the index of a file, the line before its seal, and the size of what is before it.

    Raises:
        NotAResultError: It has none.
        OSError: It cannot be read.
    """
    end = file.seek(0, 2) - SEAL_SIZE
    line, start = b"", end
    while start > 0 and b"\n" not in line and end - start < MAX_INDEX_BYTES:
        # The index is mostly short: look for its begin from its end, in ever longer parts.
        start = max(0, end - max(1 << 15, 4 * (end - start)))
        file.seek(start)
        line = file.read(end - start)
    begin = line.rfind(b"\n")
    try:
        index = json.loads(line[begin + 1 :])
    except (ValueError, RecursionError) as error:
        raise NotAResultError(f"{path} is damaged: it has no index") from error
    if begin < 0 or not isinstance(index, dict):
        raise NotAResultError(f"{path} is damaged: it has no index")
    return index, start + begin
