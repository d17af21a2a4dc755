"""Atomic writing: a file appears complete or not at all."""

import errno
import os
import secrets
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from rbstab.files.paths import exists
from rbstab.store.disk.lock import try_lock
from rbstab.store.errors import ResultExistsError

PARTIAL_SUFFIX = ".part"
"""The suffix of a file that is still being written."""

RENAMES_OPEN_FILES = sys.platform != "win32"
"""Whether the system renames and removes files that are open. Windows does not."""

_MAX_NAME_BYTES = 200
"""The part of a file's name that a partial file repeats. File systems allow 255 bytes in all."""

_REPLACE_ATTEMPTS = 50
"""Attempts to replace a file where open files cannot be replaced."""

_REPLACE_RETRY_INTERVAL = 0.02
"""Time between two attempts, s."""

_NO_SYNC_ERRORS = (errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EBADF)
"""Errors of file systems that cannot sync a folder."""


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
    with atomic_file(path, replace=replace) as file:
        write_all(file, content)


@contextmanager
def atomic_file(path: Path, *, replace: bool = False) -> Iterator[BinaryIO]:
    """Return a context that yields a hidden file for writing, and renames it at its end.

    Args:
        path: The file; its folder must exist.
        replace: Whether an existing file is replaced.

    Yields:
        A new file in the same folder, open for writing and reading, without a buffer. Write with
        `write_all`. If the block raises an error, the file is removed.

    Raises:
        ResultExistsError: The file exists and `replace` is not set.
        OSError: As `write_atomically`.
    """
    partial, file = _new_partial_file(path)
    created = os.fstat(file.fileno())
    # A second descriptor keeps the lock until the file has its name. The file must be closed
    # before: some file systems report an error only then. Where open files cannot be renamed, the
    # lock ends with the file: a writer of the same result may then remove it, which is an error.
    lock = os.dup(file.fileno()) if RENAMES_OPEN_FILES else None
    try:
        with file:
            yield file
            os.fsync(file.fileno())
        if replace:
            _replace(partial, path)
        else:
            _add_new_name(partial, path)
        _sync_folder(path.parent)
    finally:
        # The result itself may be complete. So a file that cannot be removed is no error; the next
        # writer of this result removes it. After the rename, the name may belong to another writer.
        with suppress(OSError):
            if _is_same_file(partial, created):
                partial.unlink()
        if lock is not None:
            with suppress(OSError):
                os.close(lock)


def write_all(file: BinaryIO, content: bytes | memoryview) -> None:
    """Write all bytes to a file without a buffer.

    Raises:
        OSError: A byte cannot be written, for example because the disk is full.
    """
    view = memoryview(content).cast("B")
    while view:
        # On a nearly full disk one call writes only a part, and the next call fails.
        view = view[file.write(view) :]


def remove_abandoned(path: Path) -> None:
    """Remove the partial file of a writer of a result that was killed, if there is one."""
    _remove_unlocked(_partial_path(path))


def remove_all_abandoned(folder: Path) -> None:
    """Remove the partial files of killed writers in a folder."""
    for partial in folder.glob(f".*{PARTIAL_SUFFIX}"):
        _remove_unlocked(partial)


def _remove_unlocked(partial: Path) -> None:
    """Remove a partial file, if it exists and no living writer holds its lock."""
    # The file must not be reused: it may be a second name of the result itself.
    with suppress(OSError):
        with partial.open("r+b", buffering=0) as file:
            # In the meantime its writer may have finished, and another may have made a new one.
            if not (try_lock(file) and _is_same_file(partial, os.fstat(file.fileno()))):
                return
            if RENAMES_OPEN_FILES:
                partial.unlink()
                return
        # Another writer that opens the file first keeps it: then this fails.
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


def _new_partial_file(path: Path) -> tuple[Path, BinaryIO]:
    """Create and lock the partial file of a result; one that a killed writer left is removed."""
    remove_abandoned(path)
    partial = _partial_path(path)
    while True:
        try:
            file = partial.open("x+b", buffering=0)
        except FileExistsError:
            # Another thread or process is writing the same result.
            partial = _partial_path(path, f".{secrets.token_hex(8)}")
            continue
        # The lock shows other writers that this one lives. One of them may test the file before it
        # is locked, and remove it: then create another.
        try:
            try_lock(file)
            lives = _is_same_file(partial, os.fstat(file.fileno()))
        except BlockingIOError:
            lives = False
        except OSError:
            lives = True  # Without locks nothing is lost.
        except BaseException:
            if not RENAMES_OPEN_FILES:
                file.close()
            partial.unlink(missing_ok=True)
            file.close()
            raise
        if lives:
            return partial, file
        file.close()


def _partial_path(path: Path, middle: str = "") -> Path:
    name = os.fsdecode(os.fsencode(path.name)[:_MAX_NAME_BYTES])
    return path.with_name(f".{name}{middle}{PARTIAL_SUFFIX}")


def _is_same_file(path: Path, status: os.stat_result) -> bool:
    with suppress(FileNotFoundError):
        return os.path.samestat(path.stat(), status)
    return False


def _replace(partial: Path, path: Path) -> None:
    """Rename a partial file to a name that may exist."""
    for _ in range(_REPLACE_ATTEMPTS - 1):
        try:
            partial.replace(path)
        except PermissionError:
            if RENAMES_OPEN_FILES:
                raise
            # Another process may be reading the old file, or a virus scanner either of them.
            time.sleep(_REPLACE_RETRY_INTERVAL)
        else:
            return
    partial.replace(path)


def _add_new_name(old: Path, new: Path) -> None:
    """Give a file a second name; fail if it exists, even if another process just created it."""
    try:
        os.link(old, new)
    except FileExistsError as error:
        raise ResultExistsError(f"{new} exists already") from error
    except OSError as error:
        # Some file systems have no hard links. There, another process may create
        # the file between the test and the rename.
        if exists(new):
            raise ResultExistsError(f"{new} exists already") from error
        old.rename(new)


def _sync_folder(folder: Path) -> None:
    """Sync the names in a folder to disk, where the system can do so."""
    try:
        # A folder can only be opened on POSIX, and only by those who may read it.
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except (PermissionError, AttributeError):
        return
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in _NO_SYNC_ERRORS:
            raise
    finally:
        os.close(descriptor)
