"""A function applied to many files: in this process, or to very many side by side."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from typing import TypeVar

from rbstab.processes.processors import processor_count

S = TypeVar("S")
T = TypeVar("T")

PER_WORKER = 100
"""Reading this many files takes as long as starting another worker."""


def mapped(function: Callable[[S], T], items: Sequence[S]) -> Iterator[T]:
    """Yield what a function makes of each item, in order.

    Args:
        function: At the top level of a module; what it takes and returns must be picklable.
        items: Its arguments.
    """
    workers = min(processor_count(), len(items) // PER_WORKER)
    if workers < 2:
        yield from map(function, items)
        return
    from rbstab.processes.workers import worker_pool  # imported late: few need workers

    done = 0
    try:
        with worker_pool(workers) as pool:
            for result in pool.map(function, items, chunksize=PER_WORKER // 10):
                yield result
                done += 1
    except BrokenExecutor:
        # A worker was killed, perhaps because memory ran out.
        yield from map(function, items[done:])
