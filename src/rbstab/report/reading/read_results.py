"""Read the results of a report in worker processes.

A result that cannot be read raises no error: it is returned as `Unread`.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple

from rbstab.experiment.stored_config import StoredConfig, stored_config
from rbstab.processes.processors import processor_count
from rbstab.report.model.document import Unread
from rbstab.report.model.words import untrusted
from rbstab.report.reading.untrusted import SWEEP, content_of, file_of
from rbstab.store.disk.isolated_reading import IsolatedReader
from rbstab.store.errors import StoreError
from rbstab.store.result import Result

RESULTS_PER_WORKER = 100
"""Reading this many results takes as long as starting another worker."""


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
    count = max(1, min(processor_count(), len(paths) // RESULTS_PER_WORKER))
    readers: SimpleQueue[IsolatedReader] = SimpleQueue()
    for number in range(count):
        readers.put(_reader(number))

    def read(path: Path) -> Read | Unread:
        reader = readers.get()
        try:
            return read_one(path, reader)
        finally:
            readers.put(reader)

    pool = ThreadPoolExecutor(count)
    try:
        yield from pool.map(read, paths)
    finally:
        # After an interrupt, no further file is begun.
        pool.shutdown(wait=False, cancel_futures=True)


@cache
def _reader(_: int) -> IsolatedReader:
    """Return one of several readers. Each keeps its worker, because starting one takes long."""
    return IsolatedReader(read_file)


def _reason(path: Path, error: Exception) -> str:
    """Return the message of an error without the path, which is shown beside it."""
    expected = isinstance(error, StoreError | OSError | ValueError)
    text = str(error) if expected else f"its content is wrong ({type(error).__name__}: {error})"
    for prefix in (f"{path} ", f"{path}: "):
        text = text.removeprefix(prefix)
    return untrusted(text)
