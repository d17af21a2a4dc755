"""Reading many results: what cannot be read is no error, and many are read by several processes."""

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
"""Results for which the start of further processes is made up."""

PIECE = 25
"""Results that a process reads at a time."""


class ReadRun(NamedTuple):
    """A run that was read: its file, what is in it, and its config."""

    file: Path
    result: Result
    stored: StoredConfig


class ReadSweep(NamedTuple):
    """A sweep: its file."""

    file: Path


Read = ReadRun | ReadSweep


def read_all(paths: Sequence[Path]) -> Iterator[Read | Unread]:
    """Reads results, in their order; see `opening`.

    HDF5 makes most of the work, and lets only one thread of a process do it.
    """
    done = 0
    if len(paths) >= MIN_FOR_PROCESSES and processor_count() > 1:
        # A process that dies takes its pool with it: the rest is read here.
        with suppress(BrokenProcessPool):
            for found in _read_in_pool(paths):
                done += 1
                yield found
    yield from map(read_one, paths[done:])


def read_one(path: Path) -> Read | Unread:
    """Reads a result."""
    try:
        file = file_of(path)
        content = content_of(file)
        if content == SWEEP:
            return ReadSweep(file)
        return ReadRun(file, content, stored_config(content))
    except (StoreError, OSError, ValueError) as error:
        return Unread(untrusted(path), _reason(path, error))


def _read_in_pool(paths: Sequence[Path]) -> Iterator[Read | Unread]:
    with worker_pool(min(processor_count(), len(paths) // PIECE)) as pool:
        yield from pool.map(read_one, paths, chunksize=PIECE)


def _reason(path: Path, error: Exception) -> str:
    """What an error says, without the path, which stands beside it."""
    text = str(error)
    for lead in (f"{path} ", f"{path}: "):
        text = text.removeprefix(lead)
    return untrusted(text)
