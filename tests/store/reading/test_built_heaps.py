"""Protects the check of heaps: heaps built by hand, as the format of HDF5 describes them."""

import pytest

from rbstab.store.reading.text_heaps import find_texts

SIZE = 4096
HEADER = 16


def entry(number, size):
    return number.to_bytes(2, "little") + bytes(6) + size.to_bytes(8, "little")


def text(size):
    """A text of this many bytes, filled to a multiple of 8."""
    return entry(1, size) + b"x" * (-(-size // 8) * 8)


def heap(*entries, size=SIZE, free=None):
    """A heap with these entries; `free` is the number in its last one, default the space left."""
    content = b"GCOL\x01\x00\x00\x00" + size.to_bytes(8, "little") + b"".join(entries)
    left = size - len(content)
    if left >= HEADER:
        content += entry(0, left if free is None else free) + bytes(left - HEADER)
    return content + bytes(size - len(content))


FULL = heap(text(SIZE - 2 * HEADER))
GOOD = heap(text(5), text(8), text(100))


@pytest.fixture
def is_whole(tmp_path):
    def is_whole(content):
        path = tmp_path / "a"
        path.write_bytes(content)
        with path.open("rb") as file:
            return find_texts(file) is not None

    return is_whole


BEFORE = bytes(800)

WHOLE = {
    "nothing": b"",
    "no heap": BEFORE,
    "an empty heap": BEFORE + heap(),
    "some texts": BEFORE + GOOD,
    "no space left": BEFORE + FULL,
    "no space left, with other data behind it": BEFORE + FULL + b"\x07" * 100,
    "space for one header": BEFORE + heap(text(SIZE - 3 * HEADER)),
    "space for less than a header": BEFORE + heap(text(SIZE - 2 * HEADER - 8)),
    "two heaps": BEFORE + GOOD + FULL,
    "data between two heaps": BEFORE + GOOD + b"\x07" * 5000 + GOOD,
    "a large heap": BEFORE + heap(text(20_000), size=3 * SIZE * 2),
}

DAMAGED = {
    "wrong space for one header": BEFORE + heap(text(SIZE - 3 * HEADER), free=8),
    "wrong space": BEFORE + heap(text(5), free=SIZE),
    "the second of two heaps": BEFORE + GOOD + heap(text(5), free=8),
    "the first of two heaps": BEFORE + heap(text(5), free=8) + GOOD,
    "the last of three heaps": BEFORE + GOOD + bytes(20_000) + FULL + heap(text(5), free=8),
    "a heap that is cut": BEFORE + GOOD[:-1],
    "a text that is cut": BEFORE + heap(text(2 * SIZE - 2 * HEADER), size=2 * SIZE)[:SIZE],
    "a text beyond its heap": BEFORE + heap(text(100)).replace(entry(1, 100), entry(1, 4065)) * 2,
    "a heap that is too small": BEFORE + heap(text(5), size=SIZE - 8),
}


@pytest.mark.parametrize("name", WHOLE)
def test_whole_heaps(is_whole, name):
    assert is_whole(WHOLE[name])


@pytest.mark.parametrize("name", DAMAGED)
def test_damaged_heaps(is_whole, name):
    assert not is_whole(DAMAGED[name])
