"""A Dask cluster as a pool of workers.

Dask keeps no record of finished shards: a sweep resumes from its own files.
"""

import time
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager, suppress
from pathlib import Path

from distributed import Client, KilledWorker

from rbstab.files.paths import is_file
from rbstab.sweep.execution.computing import (
    Computed,
    ExecutorError,
    refuse_other_versions,
    versions,
)
from rbstab.sweep.execution.pools import Pool

TIME_LIMIT = 10.0
"""s in which a scheduler must answer."""

COUNT_INTERVAL = 2.0
"""s between two counts of the workers' threads."""


class ClusterError(ExecutorError):
    """A cluster cannot be reached, or the connection is lost."""


@contextmanager
def cluster(address: str, engine: str, time_limit: float | None = None) -> Iterator[Pool]:
    """Connect to a cluster, and yield its workers.

    Args:
        address: The scheduler's address, such as tcp://host:8786, or the path of its JSON file.
        engine: The name of the engine that integrates members.
        time_limit: The scheduler must answer in this time, s; default `TIME_LIMIT`.

    Raises:
        ClusterError: The scheduler does not answer, or the address is wrong.
        WorkerDiffersError: A worker has other versions than this process.
    """
    time_limit = time_limit or TIME_LIMIT
    client = _client(address, time_limit)
    try:
        _check_workers(client, engine)
        yield _Cluster(client, address)
    finally:
        # The scheduler may be gone; then there is nothing to close.
        with suppress(OSError, TimeoutError):
            client.close(timeout=time_limit)


def _client(address: str, time_limit: float) -> Client:
    target = {"address": address}
    if address.endswith(".json"):
        try:
            if not is_file(Path(address)):
                raise ClusterError("there is no such file")
        except OSError as error:
            raise ClusterError(f"the file cannot be read: {error.strerror or error}") from error
        target = {"scheduler_file": address}
    try:
        return Client(**target, timeout=time_limit, set_as_default=False)
    except (OSError, TimeoutError, ValueError, KeyError, ImportError) as error:
        raise ClusterError(f"the scheduler cannot be reached: {error}") from error


def _check_workers(client: Client, engine: str) -> None:
    """Refuse workers with other versions, and those without this program: a task ends them."""
    try:
        answers = client.run(versions, engine, on_error="return")
    except Exception as error:
        # The error may have any type: a worker without rbstab raises its own.
        raise ClusterError(f"the versions of the workers cannot be read: {error}") from error
    for worker, answer in answers.items():
        if isinstance(answer, OSError):
            continue  # this worker is gone
        if isinstance(answer, BaseException):
            name = type(answer).__name__
            raise ClusterError(f"the worker {worker} cannot compute: {name}: {answer}")
        refuse_other_versions(versions(engine), answer, worker)


class _Cluster(Pool):
    """The workers of a cluster, which may join and leave at any time."""

    lost = (*Pool.lost, KilledWorker)
    may_grow = True

    def __init__(self, client: Client, address: str) -> None:
        super().__init__(self._connect, 0)
        self._client = client
        self._address = address
        self._counted_at = float("-inf")

    def _connect(self) -> Executor:
        # A pure task that has failed once would give the old error again, without running.
        executor: Executor = self._client.get_executor(pure=False)
        return executor

    def threads(self) -> int:
        """Return the number of threads of all workers, counted every `COUNT_INTERVAL`."""
        with self._errors():
            if self._client.status != "running":
                raise OSError
            if time.monotonic() - self._counted_at > COUNT_INTERVAL:
                self._threads = sum(self._client.nthreads().values())
                self._counted_at = time.monotonic()
        return self._threads

    def submit(self, start: int, stop: int) -> "Future[Computed]":
        """Let a worker compute the members from number `start` up to `stop`."""
        with self._errors():
            return super().submit(start, stop)

    def close(self) -> None:
        """Cancel what is running."""
        with suppress(OSError, TimeoutError, ValueError, RuntimeError):
            if self._client.status == "running":
                super().close()

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except (OSError, TimeoutError) as error:
            raise ClusterError(
                f"the scheduler at {self._address} does not answer any more"
            ) from error
