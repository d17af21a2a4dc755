"""Random damage to the bytes of a file, as disks, cables and crashes do it."""

from collections.abc import Callable

import numpy as np
from support.results import sealed

from rbstab.store.disk.seal import SEAL_SIZE


def flip(content, rng):
    """Flip up to 20 bits."""
    for at in rng.integers(0, len(content), int(rng.integers(1, 21))).tolist():
        content[at] ^= 1 << int(rng.integers(8))
    return content


def overwrite(content, rng):
    """Replace up to 20 bytes."""
    for at in rng.integers(0, len(content), int(rng.integers(1, 21))).tolist():
        content[at] = int(rng.integers(256))
    return content


def truncate(content, rng):
    return content[: int(rng.integers(len(content)))]


def zero_block(content, rng):
    start, size = int(rng.integers(len(content))), int(rng.choice([1, 8, 64, 512, 4096]))
    content[start : start + size] = bytes(len(content[start : start + size]))
    return content


def zero_rest(content, rng):
    """Zero everything from some byte on, as a file system does that lost power."""
    start = int(rng.integers(len(content)))
    content[start:] = bytes(len(content) - start)
    return content


def append(content, rng):
    return content + rng.bytes(int(rng.choice([1, 8, 80, 5000])))


def insert(content, rng):
    at = int(rng.integers(len(content)))
    return content[:at] + rng.bytes(int(rng.integers(1, 20))) + content[at:]


def swap_blocks(content, rng):
    size = int(rng.choice([8, 64, 512]))
    a, b = sorted((size * rng.integers(0, max(1, len(content) // size), 2)).tolist())
    if b + size <= len(content) and a + size <= b:
        content[a : a + size], content[b : b + size] = content[b : b + size], content[a : a + size]
    return content


DAMAGES: tuple[Callable[[bytearray, np.random.Generator], bytearray], ...] = (
    flip,
    overwrite,
    truncate,
    zero_block,
    zero_rest,
    append,
    insert,
    swap_blocks,
)


def as_it_is(content):
    return content


def without_seal(content):
    """Return damaged content as a file that never had a seal."""
    return content[:-SEAL_SIZE]


def sealed_again(content):
    """Return damaged content with a right seal."""
    return sealed(content[:-SEAL_SIZE])


SEALS = (as_it_is, without_seal, sealed_again)


def is_sealed_again(seed):
    """Return whether `damaged_and_sealed` gives damaged content a right seal."""
    return SEALS[seed // len(DAMAGES) % len(SEALS)] is sealed_again


def damaged(content, seed):
    """Return damaged content; the seed decides the damage."""
    rng = np.random.default_rng(seed)
    return bytes(DAMAGES[seed % len(DAMAGES)](bytearray(content), rng))


def damaged_and_sealed(content, seed):
    """Return damaged content with its seal damaged too, removed, or right again."""
    seal = SEALS[seed // len(DAMAGES) % len(SEALS)]
    if seal is as_it_is:
        return damaged(content, seed)
    # What is damaged is the content; the seal is then removed or made anew.
    harmed = damaged(content[:-SEAL_SIZE], seed)
    return seal(harmed + bytes(SEAL_SIZE))
