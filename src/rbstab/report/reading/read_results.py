"""Read the results of a report in worker processes.

A result that cannot be read raises no error: it is returned as `Unread`.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.stored_config import StoredConfig, stored_config
from rbstab.experiment.summary import Summary, summary_of
from rbstab.report.model.document import Unread
from rbstab.report.model.words import untrusted
from rbstab.report.reading.answers import Answers, answers_of
from rbstab.report.reading.untrusted import content_of, file_of
from rbstab.store.disk.identity import Identity
from rbstab.store.disk.isolated_reading import FILES_PER_WORKER, IsolatedReaders
from rbstab.store.errors import StoreError
from rbstab.store.reading.known_places import use_known_places
from rbstab.store.result import Result
from rbstab.store.table_file import CheckedTable

MANY = 2 * FILES_PER_WORKER
"""From this many results on there are several workers, so that they save time."""


class ReadRun(NamedTuple):
    """A run that was read: its file, its content and its config.

    summary and answers are None if they were not computed, or cannot be.
    """

    file: Path
    result: Result
    stored: StoredConfig
    summary: Summary | None
    answers: Answers | None = None


class ReadSweep(NamedTuple):
    """A sweep that was checked: its file, whose content is read later.

    identity is None if the file must be checked again (`rbstab.store.table_file.CheckedTable`).
    """

    file: Path
    identity: Identity | None


Read = ReadRun | ReadSweep


def read_file(file: Path) -> Read:
    """Read the file of a run or a sweep in this process.

    Raises:
        StoreError: The file holds neither, or cannot be read.
    """
    content = content_of(file)
    if isinstance(content, CheckedTable):
        return ReadSweep(file, content.identity)
    return ReadRun(file, content, stored_config(content), _summary_of(content))


def _summary_of(content: Result) -> Summary | None:
    """Return the summary of a run, which takes long; None if it has none.

    It is computed here because runs are read side by side.
    """
    try:
        return summary_of(content)
    except Exception:
        # Where the summary is needed, it is computed again, with its error.
        return None


def read_with_answers(file: Path) -> Read:
    """Read one of many files in this process, and answer what a report asks of a run.

    Raises:
        StoreError: As `read_file`.
    """
    use_known_places()
    read = read_file(file)
    if isinstance(read, ReadSweep):
        return read
    config = read.stored.config
    try:
        proof = None if config is None else cached_proof(file.parent, config)
        return read._replace(answers=answers_of(read.result, config, proof))
    except Exception:
        # Where the answers are needed, they are computed again, with their error.
        return read


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
    readers = _readers if len(paths) < MANY else _readers_with_answers
    yield from readers.map(read_one, paths)


_readers, _readers_with_answers = IsolatedReaders(read_file), IsolatedReaders(read_with_answers)


def _reason(path: Path, error: Exception) -> str:
    """Return the message of an error without the path, which is shown beside it."""
    expected = isinstance(error, StoreError | OSError | ValueError)
    text = str(error) if expected else f"its content is wrong ({type(error).__name__}: {error})"
    for prefix in (f"{path} ", f"{path}: "):
        text = text.removeprefix(prefix)
    return untrusted(text)
