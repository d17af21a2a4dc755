"""Atomic writing: a file appears complete or not at all."""

import os
import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rbstab.store.errors import ResultExistsError

PARTIAL_SUFFIX = ".part"
"""The suffix of a file that is still being written."""


def write_atomically(path: Path, content: bytes, *, replace: bool = False) -> None:
    """Write a file atomically: at any time it is absent, unchanged, or complete.

    The content is written to a hidden file in the same folder, synced to disk, and then renamed.

    Args:
        path: The file; its folder must exist.
        content: The bytes.
        replace: Whether an existing file is replaced.

    Raises:
        ResultExistsError: The file exists and `replace` is not set.
        OSError: The file cannot be written, for example because the disk is full.
    """
    with atomic_path(path, replace=replace) as partial, partial.open("xb") as file:
        file.write(content)


@contextmanager
def atomic_path(path: Path, *, replace: bool = False) -> Iterator[Path]:
    """Return a context that yields a hidden path for writing, and renames the file at its end.

    Args:
        path: The file; its folder must exist.
        replace: Whether an existing file is replaced.

    Yields:
        An unused path in the same folder. If the block raises an error, the file there is removed.

    Raises:
        ResultExistsError: The file exists and `replace` is not set.
        OSError: As `write_atomically`.
    """
    # The random name is unique. Another thread must not write to the same file. A killed process
    # may have left a partial file that is a hard link to the result itself.
    partial = path.with_name(f".{path.name}.{secrets.token_hex(8)}{PARTIAL_SUFFIX}")
    try:
        yield partial
        with partial.open("r+b") as file:
            os.fsync(file.fileno())
        if replace:
            partial.replace(path)
        else:
            _add_new_name(partial, path)
        _sync_folder(path.parent)
    finally:
        partial.unlink(missing_ok=True)


def remove_partial_files(folder: Path, older_than: float = 0.0) -> None:
    """Remove the partial files that killed writers left in a folder.

    Args:
        folder: The folder.
        older_than: Remove only files that were last written more than this time ago, s; 0 removes
            all. Set it if other processes may be writing.
    """
    for partial in folder.glob(f".*{PARTIAL_SUFFIX}"):
        with suppress(FileNotFoundError):
            if not older_than or time.time() - partial.stat().st_mtime > older_than:
                partial.unlink()


def move_aside(path: Path, new: Path) -> None:
    """Rename a file; the new name must be unused.

    Raises:
        ResultExistsError: The new name exists.
        OSError: As `write_atomically`.
    """
    _add_new_name(path, new)
    path.unlink(missing_ok=True)
    _sync_folder(path.parent)


def _add_new_name(old: Path, new: Path) -> None:
    """Give a file a second name; fail if it exists, even if another process just created it."""
    try:
        os.link(old, new)
    except FileExistsError as error:
        raise ResultExistsError(f"{new} exists already") from error
    except OSError as error:
        # Some file systems have no hard links. There, another process may create
        # the file between the test and the rename.
        if new.exists():
            raise ResultExistsError(f"{new} exists already") from error
        old.rename(new)


def _sync_folder(folder: Path) -> None:
    # A folder can only be opened on POSIX. Other systems have no way to sync the rename.
    with suppress(OSError, AttributeError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
