"""Reading files of unknown origin in a worker process, with limits of time and memory.

On a damaged or hostile file HDF5 may hang, crash, or fill the memory.
"""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

from rbstab.store.disk.existence import path_exists
from rbstab.store.errors import NotAResultError, StoreError

if TYPE_CHECKING:
    from rbstab.processes.isolated import IsolatedFunction, Limits

MIN_DEADLINE = 5.0
"""s; the longest time to read a small file."""

READING_SPEED = 20e6
"""bytes/s; a slow disk is faster."""

MIN_MEMORY = 200_000_000
"""bytes; the memory to read a small file. A worker has 80 MB before; together less than 300 MB."""

MEMORY_FACTOR = 4
"""Memory for each byte of a file."""


class IsolatedReader:
    """A function that reads a file, called in a worker process.

    The worker is started for the first file and kept. Threads take turns.

    Args:
        read: A function of a path, at the top level of a module. It raises store errors.
    """

    def __init__(self, read: Callable[[Path], Any]) -> None:
        self._read = read
        self._isolated: IsolatedFunction | None = None
        self._lock = Lock()

    def __call__(self, path: Path) -> Any:
        """Return the value of the function.

        Raises:
            NotAResultError: Reading took too long or crashed: the file is damaged.
            StoreError: The function raised it, or there is not enough memory.
        """
        # Imported late: most commands read no file without a seal.
        from rbstab.processes.isolated import CrashError, DeadlineError
        from rbstab.processes.workers import WorkerDiedError

        limits = read_limits(path)
        with self._lock:
            try:
                return self._call(path, limits)
            except WorkerDiedError:
                # This system starts no processes. The checks before reading still hold.
                return self._read(path)
            except DeadlineError as error:
                raise NotAResultError(
                    f"{path} is damaged: HDF5 did not read it within {limits.deadline:.0f} s"
                ) from error
            except CrashError as error:
                raise NotAResultError(f"{path} is damaged: HDF5 crashed on reading it") from error
            except MemoryError as error:
                raise StoreError(
                    f"{path} needs more than {limits.memory / 1e6:.0f} MB of memory, too much for "
                    "its size"
                ) from error

    def _call(self, path: Path, limits: "Limits") -> Any:
        from rbstab.processes.isolated import CrashError, IsolatedFunction

        if self._isolated is None:
            self._isolated = IsolatedFunction(self._read)
        # The file need not be the cause of the first crash: something may have killed the worker.
        with suppress(CrashError):
            return self._isolated(path, limits)
        return self._isolated(path, limits)


def read_limits(path: Path) -> "Limits":
    """Return the limits for reading a file: they grow with its size.

    Raises:
        StoreError: The file cannot be read.
    """
    from rbstab.processes.isolated import Limits

    size = path.stat().st_size if path_exists(path) else 0
    return Limits(MIN_DEADLINE + size / READING_SPEED, MIN_MEMORY + MEMORY_FACTOR * size)
