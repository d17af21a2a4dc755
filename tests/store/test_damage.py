"""Protects against damaged files: opening one gives a result or an error of the store."""

import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from support.results import assert_equal, result

from rbstab.store.disk.seal import SEAL_SIZE
from rbstab.store.errors import NotAResultError
from rbstab.store.run_file import open_result, write_result

HEAP = b"GCOL"
"""The signature of HDF5's heap of texts."""

HEAP_SIZE = 4096


@pytest.fixture
def image(tmp_path):
    """A file with an undamaged result."""
    path = tmp_path / "image.h5"
    write_result(path, result())
    return path


def outcomes(image, seeds, places, seconds=30):
    """Open a damaged copy for each seed and count the outcomes; every seed must have one."""
    program = Path(__file__).with_name("damage.py")
    numbers = (seeds.start, seeds.stop, *places)
    command = [sys.executable, program, image, image.with_name("damaged.h5"), *numbers]
    try:
        done = subprocess.run(
            [str(part) for part in command],
            capture_output=True,
            text=True,
            timeout=seconds,
            check=False,
        )
        output = done.stdout
    except subprocess.TimeoutExpired as expired:
        output = (expired.stdout or b"").decode()
    found = dict(line.split(" ", 1) for line in output.splitlines())
    assert list(found) == [str(seed) for seed in seeds], "crashed, or did not end"
    assert set(found.values()) <= {"result", "NotAResultError", "NewerSchemaError"}
    return Counter(found.values())


def test_truncated(image, tmp_path):
    """At many lengths: closely at the beginning, where the structure is, and then in steps."""
    content, path = image.read_bytes(), tmp_path / "short.h5"
    lengths = [*range(0, 200, 7), *range(200, len(content), 311), len(content) - 1]
    for length in lengths:
        path.write_bytes(content[:length])
        with pytest.raises(NotAResultError, match="damaged"):
            open_result(path)


def test_overwritten_from_the_middle(image, tmp_path):
    """After a crash of the file system the length may be right and the rest zero."""
    content, path = image.read_bytes(), tmp_path / "zeros.h5"
    heap = content.index(HEAP)
    for length in (0, 8, 96, 500, 1000, heap):
        path.write_bytes(content[:length] + bytes(len(content) - length))
        with pytest.raises(NotAResultError):
            open_result(path)


def test_flipped_before_the_texts(image):
    """The damaged bytes are the structure of the file."""
    end = image.read_bytes().index(HEAP)
    found = outcomes(image, range(400), (0, end))
    assert found["NotAResultError"] > 300


def test_flipped_behind_the_texts(image):
    """The damaged bytes are structure and numbers; HDF5 does not notice a changed number."""
    begin = image.read_bytes().index(HEAP) + HEAP_SIZE
    found = outcomes(image, range(400, 700), (begin, image.stat().st_size))
    assert found["NotAResultError"] > 100


def test_flipped_in_the_texts(image):
    begin = image.read_bytes().index(HEAP)
    outcomes(image, range(700, 760), (begin, begin + HEAP_SIZE), seconds=3)


def test_a_flipped_number_is_noticed(image, tmp_path):
    content = bytearray(image.read_bytes())
    at = content.index(result()["lyapunov"].tobytes())
    content[at + 7] ^= 1
    (tmp_path / "flipped.h5").write_bytes(content)
    with pytest.raises(NotAResultError):
        open_result(tmp_path / "flipped.h5")


def test_a_file_without_a_seal_is_judged_by_its_digest(image, tmp_path):
    """Files of older versions, and copies made by other programs, have no seal."""
    content = image.read_bytes()
    bare = content[:-SEAL_SIZE]
    (tmp_path / "bare.h5").write_bytes(bare)
    assert_equal(open_result(tmp_path / "bare.h5"), result())
    flipped = bytearray(bare)
    flipped[content.index(result()["lyapunov"].tobytes()) + 7] ^= 1
    (tmp_path / "flipped.h5").write_bytes(flipped)
    with pytest.raises(NotAResultError):
        open_result(tmp_path / "flipped.h5")
