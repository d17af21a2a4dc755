"""Single runs of members, in several worker processes."""

from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress

from rbstab.mechanics.numbers import Array
from rbstab.processes.workers import worker_pool
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.plan import Plan

POLL_INTERVAL = 0.2
"""s; the longest wait for a result."""

MIN_FOR_PROCESSES = 16
"""Fewest members for which starting worker processes saves time."""

Outcome = dict[str, Array]


def run_singles(
    plan: Plan, engine: str, members: Sequence[int], processes: int
) -> Generator[tuple[int, Outcome] | None]:
    """Integrate some members as single runs.

    Args:
        plan: The plan.
        engine: The engine, in place of the plan's.
        members: Their numbers.
        processes: The largest number of processes.

    Yields:
        A member and its outcome, in any order; None when idle. Closing the generator ends the
        workers.
    """
    left = list(members)
    if processes > 1 and len(left) >= MIN_FOR_PROCESSES:
        # If a worker dies (out of memory, say), its pool breaks: the rest runs in this process.
        with suppress(BrokenProcessPool):
            for found in _run_in_pool(plan, engine, left, processes):
                if found is not None:
                    left.remove(found[0])
                yield found
    singles = SingleRuns(plan, engine) if left else None
    for member in left:
        assert singles is not None
        yield member, singles.compute(member, member + 1).outcome


def _run_in_pool(
    plan: Plan, engine: str, members: Sequence[int], processes: int
) -> Iterator[tuple[int, Outcome] | None]:
    with worker_pool(processes, _set_up, plan, engine) as pool:
        pending: set[Future[tuple[int, Outcome]]] = {
            pool.submit(_run_one, member) for member in list(members)
        }
        while pending:
            done, pending = wait(pending, POLL_INTERVAL, FIRST_COMPLETED)
            if not done:
                yield None
            for future in done:
                yield future.result()


_singles: SingleRuns | None = None
"""Integrates the members of a worker process; set by `_set_up`."""


def _set_up(plan: Plan, engine: str) -> None:
    global _singles  # noqa: PLW0603 (the state of a worker between tasks)
    _singles = SingleRuns(plan, engine)


def _run_one(member: int) -> tuple[int, Outcome]:
    assert _singles is not None
    return member, _singles.compute(member, member + 1).outcome
