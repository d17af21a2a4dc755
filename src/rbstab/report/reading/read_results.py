"""Read the results of a report in worker processes.

A result that cannot be read raises no error: it is returned as `Unread`.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from rbstab.experiment.stored_config import StoredConfig, stored_config
from rbstab.report.model.document import Unread
from rbstab.report.model.words import untrusted
from rbstab.report.reading.untrusted import SWEEP, content_of, file_of
from rbstab.store.disk.isolated_reading import IsolatedReaders
from rbstab.store.errors import StoreError
from rbstab.store.result import Result


class ReadRun(NamedTuple):
    """A run that was read: its file, its content, and its config."""

    file: Path
    result: Result
    stored: StoredConfig


class ReadSweep(NamedTuple):
    """A sweep; only its file is known, and its content is read later."""

    file: Path


Read = ReadRun | ReadSweep


def read_file(file: Path) -> Read:
    """Read the file of a run or a sweep in this process.

    Raises:
        StoreError: The file holds neither, or cannot be read.
    """
    content = content_of(file)
    if content == SWEEP:
        return ReadSweep(file)
    return ReadRun(file, content, stored_config(content))


def read_one(path: Path, reader: Callable[[Path], Read] = read_file) -> Read | Unread:
    """Read a result.

    Args:
        path: The result.
        reader: Reads its file.
    """
    try:
        return reader(file_of(path))
    except Exception as error:
        # Whatever a file contains, the others are still reported.
        return Unread(untrusted(path), _reason(path, error))


def read_all(paths: Sequence[Path]) -> Iterator[Read | Unread]:
    """Read results, and return them in the same order.

    Worker processes read them, with limits of time and memory: anybody may have written the files,
    and HDF5 may hang or crash on them.
    """
    yield from _readers.map(read_one, paths)


_readers = IsolatedReaders(read_file)


def _reason(path: Path, error: Exception) -> str:
    """Return the message of an error without the path, which is shown beside it."""
    expected = isinstance(error, StoreError | OSError | ValueError)
    text = str(error) if expected else f"its content is wrong ({type(error).__name__}: {error})"
    for prefix in (f"{path} ", f"{path}: "):
        text = text.removeprefix(prefix)
    return untrusted(text)
