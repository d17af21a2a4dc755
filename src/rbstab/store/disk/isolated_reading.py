"""Reading files of unknown origin in a worker process, with limits of time and memory.

On a damaged or hostile file HDF5 may hang, crash, or fill the memory.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from threading import Lock
from typing import TYPE_CHECKING, Any, TypeVar

from rbstab.processes.processors import processor_count
from rbstab.store.disk.existence import path_exists
from rbstab.store.errors import NotAResultError, StoreError

if TYPE_CHECKING:
    from rbstab.processes.isolated import IsolatedFunction, Limits

T = TypeVar("T")

FILES_PER_WORKER = 100
"""Reading this many files takes as long as starting another worker."""

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


class IsolatedReaders:
    """Several readers of one kind, which read files side by side.

    Their workers are kept, because starting one takes long.

    Args:
        read: As for `IsolatedReader`.
    """

    def __init__(self, read: Callable[[Path], Any]) -> None:
        self._read = read
        self._readers: list[IsolatedReader] = []

    def map(self, use: Callable[[Path, IsolatedReader], T], paths: Sequence[Path]) -> Iterator[T]:
        """Yield what a function makes of each path and a reader, in the order of the paths."""
        count = max(1, min(processor_count(), len(paths) // FILES_PER_WORKER))
        while len(self._readers) < count:
            self._readers.append(IsolatedReader(self._read))
        free: SimpleQueue[IsolatedReader] = SimpleQueue()
        for reader in self._readers[:count]:
            free.put(reader)

        def used(path: Path) -> T:
            reader = free.get()
            try:
                return use(path, reader)
            finally:
                free.put(reader)

        pool = ThreadPoolExecutor(count)
        try:
            yield from pool.map(used, paths)
        finally:
            # After an interrupt, no further file is begun.
            pool.shutdown(wait=False, cancel_futures=True)


def read_limits(path: Path) -> "Limits":
    """Return the limits for reading a file: they grow with its size.

    Raises:
        StoreError: The file cannot be read.
    """
    from rbstab.processes.isolated import Limits

    size = path.stat().st_size if path_exists(path) else 0
    return Limits(MIN_DEADLINE + size / READING_SPEED, MIN_MEMORY + MEMORY_FACTOR * size)
