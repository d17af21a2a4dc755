"""Store the result of a run beside other processes; no better result of its config is lost."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np

from rbstab.integrate.status import RunStatus
from rbstab.store.disk.atomic import move_aside
from rbstab.store.disk.paths import path_exists
from rbstab.store.errors import (
    NewerSchemaError,
    NotAResultError,
    ResultExistsError,
    StoreError,
)
from rbstab.store.result import Result, open_result, write_result

MAX_ATTEMPTS = 20
"""Attempts to store a result. A further one is needed if another process changes the file between
two steps, where the file system has no locks."""

LOCK_ATTEMPTS = 500
"""Attempts to lock the folder. Without the lock the result is stored nevertheless."""

LOCK_INTERVAL = 0.02
"""Time between two attempts to lock, s."""


class FiledRun(NamedTuple):
    """A run and its file.

    Attributes:
        path: The file.
        result: The result in it.
        computed: Whether the run was integrated now; otherwise its finished result was read.
        moved_aside: The new path of an earlier result that had this name; None if there was none.
        kept: Whether the run was integrated now, but the file holds a result of the same config
            that is better, or that another process has finished in the meantime. It is kept.
    """

    path: Path
    result: Result
    computed: bool = False
    moved_aside: Path | None = None
    kept: bool = False


def depends_on_machine(result: Result) -> bool:
    """Whether a repetition may reach further: the wall time ended the run, or its second run."""
    if RunStatus(result.status).depends_on_machine:
        return True
    return "trusted_until" in result and bool(np.isnan(result["trusted_until"]))


def store_run(
    path: Path, result: Result, is_final: Callable[[Result], bool], *, force: bool = False
) -> FiledRun:
    """Write a result to its file, unless the file holds a better result of the same config.

    A result that does not depend on the machine is better than one that does; of two others, the
    one that reaches further is better.

    Args:
        path: The file.
        result: The result.
        is_final: Whether a stored result of the same config need not be replaced.
        force: Whether the file holds the given result in any case. A better or a different result
            is then moved aside.

    Raises:
        ResultExistsError: A different result, or a damaged one, has that name (without `force`).
        StoreError: The result cannot be written.
    """
    aside = None
    for _ in range(MAX_ATTEMPTS):
        with _locked(path.parent):
            if not path_exists(path):
                with suppress(ResultExistsError):
                    write_result(path, result)
                    return FiledRun(path, result, computed=True, moved_aside=aside)
                continue
            now = existing_result(path, force=force)
            if now is not None and now.run_id == result.run_id:
                better = _rank(now) > _rank(result)
                if not force and (better or is_final(now)):
                    return FiledRun(path, now, moved_aside=aside, kept=True)
                if not better:
                    write_result(path, result, replace=True)
                    return FiledRun(path, result, computed=True, moved_aside=aside)
            if not force:
                refuse_different(path, now)
            aside = _moved_aside(path, now)
    raise StoreError(f"{path} cannot be written: other processes keep changing it")


def existing_result(path: Path, *, force: bool) -> Result | None:
    """Return the result in a file; None if there is no file, or a damaged one and `force` is set.

    Raises:
        ResultExistsError: The file is damaged, and `force` is not set.
        StoreError: The file cannot be read now; it may be whole, so it is not moved aside.
    """
    if not path_exists(path):
        return None
    try:
        return open_result(path)
    except (NotAResultError, NewerSchemaError) as error:
        if force:
            return None
        raise ResultExistsError(f"{error}. Use --force to move it aside.") from error


def refuse_different(path: Path, old: Result | None) -> NoReturn:
    """Raise an error: a file holds another result, or is no result (None)."""
    description = f"run {old.run_id[:8]}" if old is not None else "another file"
    raise ResultExistsError(
        f"{path} holds a different result ({description}); it is not overwritten. "
        "Choose another folder with -o, or use --force to move it aside."
    )


def aside_path(path: Path, old: Result | None) -> Path:
    """Return an unused path for an earlier result, or for a damaged file (None)."""
    middle = old.run_id[:8] if old is not None else "damaged"
    paths = [path.with_name(f"{path.stem}.{middle}{path.suffix}")]
    while path_exists(paths[-1]):
        paths.append(path.with_name(f"{path.stem}.{middle}-{len(paths)}{path.suffix}"))
    return paths[-1]


def _rank(result: Result) -> tuple[bool, float]:
    """Return a rank by which results of one config are compared; the largest is the best."""
    return not depends_on_machine(result), float(result["time"][-1])


def _moved_aside(path: Path, old: Result | None) -> Path | None:
    """Move a file aside; return its new path, or None if another process has moved it."""
    aside = aside_path(path, old)
    try:
        move_aside(path, aside)
    except (FileNotFoundError, ResultExistsError):
        return None
    except OSError as error:
        reason = error.strerror or error
        raise StoreError(f"{path} cannot be moved to {aside}: {reason}") from error
    return aside


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Return a context that holds a lock of a folder, if the system can lock folders."""
    # Without a lock, a result may be replaced by a worse one that another process writes in the
    # same millisecond. A lock of a folder leaves no file.
    with ExitStack() as opened:
        # The folder is missing or not readable, or the system cannot lock folders.
        with suppress(OSError):
            descriptor = os.open(folder, os.O_RDONLY)
            opened.callback(_close, descriptor)
            import fcntl  # Windows has none, and opens no folder

            for _ in range(LOCK_ATTEMPTS):
                with suppress(BlockingIOError):
                    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    break
                time.sleep(LOCK_INTERVAL)
        yield


def _close(descriptor: int) -> None:
    """Close what only holds a lock: nothing was written, so an error of closing means nothing."""
    with suppress(OSError):
        os.close(descriptor)
