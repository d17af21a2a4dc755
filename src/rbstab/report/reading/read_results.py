"""Read the results of a report; worker processes read them if there are many.

A result that cannot be read raises no error: it is returned as `Unread`.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from rbstab.experiment.stored_config import StoredConfig, stored_config
from rbstab.processes.processors import processor_count
from rbstab.processes.workers import worker_pool
from rbstab.report.model.document import Unread
from rbstab.report.model.words import untrusted
from rbstab.report.reading.untrusted import SWEEP, content_of, file_of
from rbstab.store.errors import StoreError
from rbstab.store.result import Result

MIN_FOR_PROCESSES = 200
"""From this number of results on, worker processes are faster than this process."""

CHUNK_SIZE = 25
"""Results that a worker reads per task."""


class ReadRun(NamedTuple):
    """A run that was read: its file, its content, and its config."""

    file: Path
    result: Result
    stored: StoredConfig


class ReadSweep(NamedTuple):
    """A sweep; only its file is known, and its content is read later."""

    file: Path


Read = ReadRun | ReadSweep


def read_all(paths: Sequence[Path]) -> Iterator[Read | Unread]:
    """Read results, and return them in the same order.

    Worker processes read them if there are many. Threads would not help: HDF5 takes most of the
    time, and only one thread of a process may run it.
    """
    done = 0
    if len(paths) >= MIN_FOR_PROCESSES and processor_count() > 1:
        # A worker that dies breaks its pool: this process then reads the rest.
        with suppress(BrokenProcessPool):
            for found in _read_in_pool(paths):
                done += 1
                yield found
    yield from map(read_one, paths[done:])


def read_one(path: Path) -> Read | Unread:
    """Read a result."""
    try:
        file = file_of(path)
        content = content_of(file)
        if content == SWEEP:
            return ReadSweep(file)
        return ReadRun(file, content, stored_config(content))
    except (StoreError, OSError, ValueError) as error:
        return Unread(untrusted(path), _reason(path, error))


def _read_in_pool(paths: Sequence[Path]) -> Iterator[Read | Unread]:
    with worker_pool(min(processor_count(), len(paths) // CHUNK_SIZE)) as pool:
        yield from pool.map(read_one, paths, chunksize=CHUNK_SIZE)


def _reason(path: Path, error: Exception) -> str:
    """Return the message of an error without the path, which is shown beside it."""
    text = str(error)
    for prefix in (f"{path} ", f"{path}: "):
        text = text.removeprefix(prefix)
    return untrusted(text)
