"""Protects seals: a file is whole only with the SHA-256 of its bytes at its end."""

import errno
import hashlib
import io
import os

import pytest
from support.hang_guard import within

from rbstab.store.disk import seal
from rbstab.store.disk.seal import (
    SEAL_SIZE,
    add_seal,
    check_seal,
    has_seal,
    read_seal,
    read_sealed,
    seal_digest,
)
from rbstab.store.errors import NotAResultError, StoreError

CONTENTS = [b"", b"1", b"12\n", bytes(100), b"7" * (3 << 20)]
"""The last is longer than what is read at once."""


def line_of(content):
    """The seal, as the documentation describes it."""
    return f"\nrbstab sha256 {hashlib.sha256(content).hexdigest()}\n".encode()


@pytest.fixture
def written(tmp_path):
    """A function that writes bytes to a file."""

    def write(content):
        path = tmp_path / "a"
        path.write_bytes(content)
        return path

    return write


@pytest.mark.parametrize("content", CONTENTS, ids=len)
def test_all_readers_agree_on_a_whole_file(written, content):
    path = written(content + line_of(content))
    digest = hashlib.sha256(content).hexdigest()
    assert add_seal(content) == content + line_of(content)
    assert seal_digest(path.read_bytes()) == digest
    assert read_sealed(path) == (content, digest)
    assert read_seal(path) == digest
    assert has_seal(path)
    check_seal(path)


@pytest.mark.parametrize("content", CONTENTS, ids=len)
def test_a_file_with_the_seal_of_another_is_damaged(written, content):
    path = written(content + line_of(content + b"x"))
    message = f"{path} is damaged: its content does not match its digest"
    assert has_seal(path)
    for read in (check_seal, read_sealed):
        with pytest.raises(NotAResultError) as caught:
            read(path)
        assert str(caught.value) == message


@pytest.mark.parametrize("content", CONTENTS, ids=len)
def test_a_file_without_a_seal(written, content):
    path = written(content)
    assert not has_seal(path)
    assert read_seal(path) is None
    for read in (check_seal, read_sealed):
        with pytest.raises(NotAResultError):
            read(path)


@pytest.mark.parametrize("left", range(SEAL_SIZE))
def test_a_part_of_a_seal_is_no_seal_but_shows_that_there_was_one(written, left):
    """A single line break may be the end of any text."""
    path = written(b"content" + line_of(b"content")[:left])
    assert has_seal(path) == (left >= 2)
    assert read_seal(path) is None
    with pytest.raises(NotAResultError):
        check_seal(path)


def test_a_line_that_is_no_seal(written):
    path = written(b"content" + line_of(b"content")[:-1] + b" ")
    assert read_seal(path) is None
    path = written(b"content\n" + line_of(b"content")[1:].replace(b"sha256", b"sha512"))
    assert read_seal(path) is None
    assert not has_seal(path)


def test_a_seal_stands_at_the_end(written):
    path = written(add_seal(b"content") + bytes(SEAL_SIZE))
    assert not has_seal(path)
    assert read_seal(path) is None
    with pytest.raises(NotAResultError):
        check_seal(path)


class FailingFile(io.BytesIO):
    """A file whose reads fail."""

    def read(self, size=-1):
        raise OSError(errno.EIO, os.strerror(errno.EIO))


@pytest.mark.parametrize("read", [read_seal, has_seal, check_seal])
def test_a_disk_that_fails_is_not_taken_for_damage(written, monkeypatch, read):
    path = written(add_seal(b"content"))
    monkeypatch.setattr(seal, "open_regular", lambda _: FailingFile(path.read_bytes()))
    with pytest.raises(StoreError) as caught:
        read(path)
    assert not isinstance(caught.value, NotAResultError)
    assert str(caught.value) == f"{path} cannot be read: {os.strerror(errno.EIO)}"


class CutFile(io.BytesIO):
    """A file that loses its end after its size was asked for."""

    def seek(self, offset, whence=0):
        position = super().seek(offset, whence)
        if whence == 2:
            self.truncate(position // 2)
        return position


def test_a_file_that_is_cut_while_it_is_read_is_damaged(written, monkeypatch):
    path = written(add_seal(bytes(1000)))
    monkeypatch.setattr(seal, "open_regular", lambda _: CutFile(path.read_bytes()))
    with pytest.raises(NotAResultError):
        within(20, check_seal, path)
