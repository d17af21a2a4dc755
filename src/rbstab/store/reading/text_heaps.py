"""The heaps in which HDF5 stores texts. On some damaged heaps HDF5 loops for ever."""

import mmap
import os
import struct
from typing import BinaryIO, NamedTuple

from rbstab.store.disk.identity import Identity, identity_of, is_old

_SIGNATURE = b"GCOL\x01\x00\x00\x00"
"""The first bytes of a heap: its name and its version."""

_HEADER_SIZE = 16
"""The size of the header of a heap, and of the header of each text in it, bytes."""

_HEADER = struct.Struct("<H6xQ")
"""The header of a text: its number in the heap, and its size."""

_MIN_SIZE = 4096
"""The smallest heap that HDF5 writes, bytes."""

_FREE_SPACE = 0
"""The number that stands for free space in place of a text."""


class Span(NamedTuple):
    """The first byte of a text in a file, and its size."""

    start: int
    size: int


Texts = dict[tuple[int, int], Span]
"""Where texts are, by the first byte of their heap and their number in it."""


MAX_KNOWN = 8
"""Maximum number of files whose heaps are known: a report reads the file of a sweep twice."""

_known: dict[Identity, Texts | None] = {}
"""What was found in the files that this process has searched."""


def find_texts(file: BinaryIO) -> Texts | None:
    """Find all texts in the heaps of an HDF5 file.

    Args:
        file: An open file.

    Returns:
        Where they are; None if the entries of a heap do not fill it exactly.
    """
    found = os.fstat(file.fileno())
    identity = identity_of(found)
    if identity in _known:
        return _known[identity]
    texts = _searched(file)
    if is_old(found):
        if len(_known) >= MAX_KNOWN:
            _known.clear()
        _known[identity] = texts
    return texts


def _searched(file: BinaryIO) -> Texts | None:
    texts: Texts = {}
    if not file.seek(0, 2):
        # An empty file cannot be mapped into memory.
        return texts
    with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        start = content.find(_SIGNATURE)
        while start >= 0:
            size = int.from_bytes(content[start + 8 : start + 16], "little")
            if size < _MIN_SIZE or not _add_texts(texts, content, start, start + size):
                return None
            start = content.find(_SIGNATURE, start + size)
    return texts


def _add_texts(texts: Texts, content: mmap.mmap, start: int, end: int) -> bool:
    """Add the texts of a heap, and return whether they fill it exactly."""
    if end > len(content):
        return False
    at = start + _HEADER_SIZE
    while at + _HEADER_SIZE <= end:
        number, size = _HEADER.unpack_from(content, at)
        if number == _FREE_SPACE:
            # The last entry; its size counts its header.
            return bool(at + size == end)
        at += _HEADER_SIZE
        texts[start, number] = Span(at, size)
        at += -(-size // 8) * 8
    return at <= end
