"""Files that appear whole or not at all."""

import os
import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rbstab.store.errors import ResultExistsError

PARTIAL = ".part"
"""How the name of a file ends that is being written."""


def write_atomically(path: Path, content: bytes, *, replace: bool = False) -> None:
    """Writes a file so that at every instant it is absent, or what was there before, or complete.

    The content goes to a hidden file in the same folder, reaches the disk, and takes its name then.

    Args:
        path: The file; its folder must exist.
        content: The bytes.
        replace: Whether a file of that name gives way.

    Raises:
        ResultExistsError: The file exists and `replace` is not set.
        OSError: The disk is full, the folder cannot be written, and the like.
    """
    with atomic_path(path, replace=replace) as partial, partial.open("xb") as file:
        file.write(content)


@contextmanager
def atomic_path(path: Path, *, replace: bool = False) -> Iterator[Path]:
    """The hidden name under which a file is to be written that takes its own name at the end.

    Args:
        path: The file; its folder must exist.
        replace: Whether a file of that name gives way.

    Yields:
        A free name in the same folder. What stands there is removed where the block raises.

    Raises:
        ResultExistsError: The file exists and `replace` is not set.
        OSError: As `write_atomically`.
    """
    # A name that no other writer has: not another thread, and not a killed process of the same
    # number, whose remains can be a second name of the result itself.
    partial = path.with_name(f".{path.name}.{secrets.token_hex(8)}{PARTIAL}")
    try:
        yield partial
        with partial.open("r+b") as file:
            os.fsync(file.fileno())
        if replace:
            partial.replace(path)
        else:
            _take_free_name(partial, path)
        _sync_folder(path.parent)
    finally:
        partial.unlink(missing_ok=True)


def remove_partial_files(folder: Path, older_than: float = 0.0) -> None:
    """Removes what killed writers left in a folder.

    Args:
        folder: The folder.
        older_than: Where others may be writing, how long ago they must have written last, s.
    """
    for remains in folder.glob(f".*{PARTIAL}"):
        with suppress(FileNotFoundError):
            if not older_than or time.time() - remains.stat().st_mtime > older_than:
                remains.unlink()


def move_aside(path: Path, new: Path) -> None:
    """Gives a file another name, which must be free.

    Raises:
        ResultExistsError: The new name is taken.
        OSError: As `write_atomically`.
    """
    _take_free_name(path, new)
    path.unlink(missing_ok=True)
    _sync_folder(path.parent)


def _take_free_name(old: Path, new: Path) -> None:
    """A second name for a file, refused where that name is taken, also by another process."""
    try:
        os.link(old, new)
    except FileExistsError as error:
        raise ResultExistsError(f"{new} exists already") from error
    except OSError as error:
        # Some file systems have no hard links; there the test and the rename are two steps.
        if new.exists():
            raise ResultExistsError(f"{new} exists already") from error
        old.rename(new)


def _sync_folder(folder: Path) -> None:
    # Only POSIX lets a folder be opened; elsewhere the rename is as durable as it gets.
    with suppress(OSError, AttributeError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
