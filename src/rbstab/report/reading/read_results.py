"""Read the results of a report.

A result that cannot be read raises no error: it is returned as `Unread`.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.stored_config import StoredConfig, stored_config
from rbstab.experiment.summary import Summary, summary_of
from rbstab.processes.mapped import PER_WORKER, mapped
from rbstab.report.model.document import Unread
from rbstab.report.model.words import untrusted
from rbstab.report.reading.answers import Answers, answers_of
from rbstab.report.reading.untrusted import file_of, result_of
from rbstab.store.errors import StoreError
from rbstab.store.result import Result

MANY = 2 * PER_WORKER
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
    """A sweep that was checked, and its members file; its columns are read later."""

    file: Path


Read = ReadRun | ReadSweep


def read_file(file: Path) -> Read:
    """Read the file of a run or a sweep in this process.

    Raises:
        StoreError: The file holds neither, or cannot be read.
    """
    result = result_of(file)
    if result is None:
        return ReadSweep(file)
    return ReadRun(file, result, stored_config(result), _summary_of(result))


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


def read_with_answers_one(path: Path) -> Read | Unread:
    """Read one of many results."""
    return read_one(path, read_with_answers)


def read_all(paths: Sequence[Path]) -> Iterator[Read | Unread]:
    """Read results, and return them in the same order; many are read by several processes."""
    yield from mapped(read_one if len(paths) < MANY else read_with_answers_one, paths)


def _reason(path: Path, error: Exception) -> str:
    """Return the message of an error without the path, which is shown beside it."""
    expected = isinstance(error, StoreError | OSError | ValueError)
    text = str(error) if expected else f"its content is wrong ({type(error).__name__}: {error})"
    for prefix in (f"{path} ", f"{path}: "):
        text = text.removeprefix(prefix)
    return untrusted(text)
