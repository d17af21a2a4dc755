"""The seal: the last line of a file, with a digest of all before it.

It shows whether a file is as it was meant: a digest is made of what is written, not of what is read
back. What stands before the seal is the content of the file, and a line of JSON, the index, which
says what the content is. So a file is read without the library of its format.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from rbstab.store.errors import NewerSchemaError, NotAResultError

FORMAT = 1
"""The version of the format of files that this program writes, and the newest that it reads."""

MAX_INDEX_BYTES = 64 << 20
"""The largest index."""

_LINE = b"\nrbstab format %03d sha256 %s\n"
SEAL_SIZE = len(_LINE % (FORMAT, b"0" * 64))
_SEAL = re.compile(rb"\nrbstab format (?P<format>[0-9]{3}) sha256 (?P<digest>[0-9a-f]{64})\n")
_OLD_SEAL = re.compile(rb"\nrbstab sha256 [0-9a-f]{64}\n\Z")

_BLOCK = 1 << 20

_DAMAGED = "{} is damaged: its content does not match its digest (or it is open for writing)"


class Sealed(NamedTuple):
    """The end of a sealed file.

    Attributes:
        digest: The SHA-256 in its seal, in hexadecimal.
        size: The size of its content, bytes: of all before the index.
        facts: Its index.
    """

    digest: str
    size: int
    facts: dict[str, Any]


def index_line(index: Mapping[str, Any]) -> bytes:
    """Return the line of JSON with an index."""
    return b"\n" + json.dumps(index, ensure_ascii=False).encode()


def seal_line(digest: str) -> bytes:
    """Return the seal with this SHA-256, in hexadecimal."""
    return _LINE % (FORMAT, digest.encode())


def read_seal(path: Path, file: BinaryIO) -> str:
    """Return the digest in the seal of a file, without checking it.

    Raises:
        NotAResultError: It has no seal.
        NewerSchemaError: It was written by a newer rbstab.
        OSError: It cannot be read.
    """
    file.seek(max(0, file.seek(0, 2) - SEAL_SIZE))
    end = file.read()
    found = _SEAL.fullmatch(end)
    if found is not None:
        if int(found["format"]) > FORMAT:
            raise NewerSchemaError(f"{path} was written by a newer rbstab; update rbstab")
        return found["digest"].decode()
    if _OLD_SEAL.search(end):
        raise NotAResultError(
            f"{path} was made before the first release; run its config again (h5py reads it, "
            "variable config)"
        )
    raise NotAResultError(
        f"{path} has no seal of rbstab: it is no result, or it was damaged or changed by another "
        "program. A result that was changed can be read with h5py"
    )


def check_seal(path: Path, file: BinaryIO) -> Sealed:
    """Read an open file and check its seal.

    Raises:
        NotAResultError: It has no seal, or not its own.
        NewerSchemaError: It was written by a newer rbstab.
        OSError: It cannot be read.
    """
    digest = read_seal(path, file)
    left, found = file.tell() - SEAL_SIZE, hashlib.sha256()
    file.seek(0)
    while left > 0 and (block := file.read(min(left, _BLOCK))):
        found.update(block)
        left -= len(block)
    if found.hexdigest() != digest:
        raise NotAResultError(_DAMAGED.format(path))
    return _with_index(path, file, digest)


def known_seal(path: Path, file: BinaryIO) -> Sealed:
    """Return the end of an open file that was checked before, or need not be.

    Raises:
        NotAResultError, NewerSchemaError, OSError: As `check_seal`.
    """
    return _with_index(path, file, read_seal(path, file))


def _with_index(path: Path, file: BinaryIO, digest: str) -> Sealed:
    """Read the index of an open file: the line before the seal."""
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
    return Sealed(digest, start + begin, index)
