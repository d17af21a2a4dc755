"""Single runs in several processes: Python code of one process runs on one core at a time."""

import signal
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from multiprocessing.connection import Connection

from rbstab.mechanics.numbers import Array
from rbstab.processes.parent_watch import exit_with_parent, parent_watch
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.plan import Plan

TICK = 0.2
"""s between two looks at silent processes."""

MIN_FOR_PROCESSES = 16
"""Members for which the start of further processes is made up."""

Outcome = dict[str, Array]


def run_singles(
    plan: Plan, engine: str, members: Sequence[int], processes: int
) -> Generator[tuple[int, Outcome] | None]:
    """Follows some members as single runs.

    Args:
        plan: The plan.
        engine: The engine, whatever the plan says.
        members: Their numbers.
        processes: How many may be used.

    Yields:
        A member and its outcome, in whatever order; None where nothing has come for a while.
        Closing the generator ends the processes.
    """
    left = list(members)
    if processes > 1 and len(left) >= MIN_FOR_PROCESSES:
        # A process that dies (for want of memory, say) takes its pool with it: the rest is done
        # here.
        with suppress(BrokenProcessPool):
            for found in _by_pool(plan, engine, left, processes):
                if found is not None:
                    left.remove(found[0])
                yield found
    singles = SingleRuns(plan, engine) if left else None
    for member in left:
        assert singles is not None
        yield member, singles.compute(member, member + 1).outcome


def _by_pool(
    plan: Plan, engine: str, members: Sequence[int], processes: int
) -> Iterator[tuple[int, Outcome] | None]:
    # Imported late: only long comparisons need it.
    from loky import ProcessPoolExecutor

    with parent_watch() as line:
        pool = ProcessPoolExecutor(processes, initializer=_begin, initargs=(plan, engine, line))
        try:
            pending: set[Future[tuple[int, Outcome]]] = {
                pool.submit(_one, m) for m in list(members)
            }
            while pending:
                done, pending = wait(pending, TICK, FIRST_COMPLETED)
                if not done:
                    yield None
                for future in done:
                    yield future.result()
        finally:
            pool.shutdown(wait=True, kill_workers=True)


_singles: SingleRuns | None = None
"""What a process of the pool follows members with."""


def _begin(plan: Plan, engine: str, line: Connection) -> None:
    global _singles  # noqa: PLW0603 (what a process keeps between its tasks)
    # A terminal interrupts all processes; only the first one decides what that means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    exit_with_parent(line)
    _singles = SingleRuns(plan, engine)


def _one(member: int) -> tuple[int, Outcome]:
    assert _singles is not None
    return member, _singles.compute(member, member + 1).outcome
