"""Hostile files with wrong bytes in the structure of HDF5."""

import re

import numpy as np
from faults.hostile.registry import hostile_bytes


@hostile_bytes
def nothing(content):
    return b""


@hostile_bytes
def only_the_signature(content):
    return content[:8]


@hostile_bytes
def zeros(content):
    return bytes(len(content))


@hostile_bytes
def another_format(content):
    return b"\x89PNG\r\n\x1a\n" + content[8:]


@hostile_bytes
def behind_a_user_block(content):
    return bytes(512) + content


@hostile_bytes
def end_of_file_far_away(content):
    """The superblock says that the file is larger than it is."""
    return content.replace(len(content).to_bytes(8, "little"), (2**62).to_bytes(8, "little"), 1)


@hostile_bytes
def endless_heap(content):
    """A heap of texts whose first object has no size: HDF5 loops for ever on it."""
    start = content.index(b"GCOL") + 16
    return content[:start] + b"\x01\x00" + bytes(14) + content[start + 16 :]


@hostile_bytes
def heap_of_any_size(content):
    start = content.index(b"GCOL") + 8
    return content[:start] + (2**40).to_bytes(8, "little") + content[start + 8 :]


SIGNATURES = rb"TREE|HEAP|GCOL|SNOD|OHDR|FRHP|FHDB|BTHD|BTLF|OCHK"


def patched(content: bytes, seed: int) -> bytes:
    """Return the content with a few wrong numbers in the structure of HDF5."""
    rng = np.random.default_rng(seed)
    found = [match.start() for match in re.finditer(SIGNATURES, content)]
    changed = bytearray(content)
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.choice(found)) + int(rng.integers(4, 60))
        value = int(rng.choice([0, 1, 255, int(rng.integers(256))]))
        width = int(rng.choice([1, 2, 4, 8]))
        changed[at : at + width] = bytes([value]) * len(changed[at : at + width])
    return bytes(changed)
