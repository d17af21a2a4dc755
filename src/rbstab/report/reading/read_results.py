"""Read the results of a report.

A result that cannot be read raises no error: it is returned as `Unread`.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.stored_config import StoredConfig, stored_config
from rbstab.experiment.summary import Summary, summary_of
from rbstab.processes.mapped import mapped
from rbstab.report.model.document import Unread
from rbstab.report.model.words import untrusted
from rbstab.report.reading.answers import Answers, answers_of
from rbstab.report.reading.untrusted import file_of, result_of
from rbstab.store.errors import StoreError
from rbstab.store.result import Result


class ReadRun(NamedTuple):
    """A run that was read: its file, its content and its config.

    summary and answers are None if they cannot be found.
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

    Of a run it is also found what takes long, because runs are read side by side.

    Raises:
        StoreError: The file holds neither, or cannot be read.
    """
    result = result_of(file)
    if result is None:
        return ReadSweep(file)
    read = ReadRun(file, result, stored_config(result), None)
    config = read.stored.config
    # Where the summary and the answers are needed, they are found again, with their errors.
    with suppress(Exception):
        read = read._replace(summary=summary_of(result))
        proof = None if config is None else cached_proof(file.parent, config)
        read = read._replace(answers=answers_of(result, config, proof))
    return read


def read_one(path: Path) -> Read | Unread:
    """Read a result."""
    try:
        return read_file(file_of(path))
    except Exception as error:
        # Whatever a file contains, the others are still reported.
        return Unread(untrusted(path), _reason(path, error))


def read_all(paths: Sequence[Path]) -> Iterator[Read | Unread]:
    """Read results, and return them in the same order; many are read by several processes."""
    yield from mapped(read_one, paths)


def _reason(path: Path, error: Exception) -> str:
    """Return the message of an error without the path, which is shown beside it."""
    expected = isinstance(error, StoreError | OSError | ValueError)
    text = str(error) if expected else f"its content is wrong ({type(error).__name__}: {error})"
    for prefix in (f"{path} ", f"{path}: "):
        text = text.removeprefix(prefix)
    return untrusted(text)
