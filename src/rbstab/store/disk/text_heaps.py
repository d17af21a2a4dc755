"""Checks of the heaps in which HDF5 stores texts. On some damaged heaps HDF5 loops for ever."""

import mmap
from typing import BinaryIO

_SIGNATURE = b"GCOL\x01\x00\x00\x00"
"""The first bytes of a heap: its name and its version."""

_HEADER_SIZE = 16
"""The size of the header of a heap, and of the header of each text in it, bytes."""

_MIN_SIZE = 4096
"""The smallest heap that HDF5 writes, bytes."""

_FREE_SPACE = 0
"""The number that stands for free space in place of a text."""


def heaps_are_whole(file: BinaryIO) -> bool:
    """Return whether the entries of each heap of an HDF5 file fill it exactly.

    Args:
        file: An open file.
    """
    if not file.seek(0, 2):
        # An empty file cannot be mapped into memory.
        return True
    with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        start = content.find(_SIGNATURE)
        while start >= 0:
            size = _number(content, start + 8, 8)
            if size < _MIN_SIZE or not _is_whole(content, start, start + size):
                return False
            start = content.find(_SIGNATURE, start + size)
    return True


def _is_whole(content: mmap.mmap, start: int, end: int) -> bool:
    if end > len(content):
        return False
    at = start + _HEADER_SIZE
    while at + _HEADER_SIZE <= end:
        number, size = _number(content, at, 2), _number(content, at + 8, 8)
        if number == _FREE_SPACE:
            # The last entry; its size counts its header.
            return at + size == end
        at += _HEADER_SIZE + -(-size // 8) * 8
    return at <= end


def _number(content: mmap.mmap, at: int, size: int) -> int:
    return int.from_bytes(content[at : at + size], "little")
