"""A whole sweep, from its plan to its one file."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import NamedTuple

from rbstab.sweep.begin import begun
from rbstab.sweep.check import ENGINE, Check, check_of
from rbstab.sweep.engine import EngineFactory, factory_for
from rbstab.sweep.execute import Execution, ShardDone, Survey, Trouble, survey_of
from rbstab.sweep.folder import SweepFolder
from rbstab.sweep.gather import digest_of_shards, gather, is_gathered
from rbstab.sweep.plan import Plan
from rbstab.sweep.room import check_room


class Started(NamedTuple):
    """The folder is there, and what is done already; for the rest see `Begun`."""

    folder: SweepFolder
    survey: Survey
    kept_aside: Path | None
    changed: tuple[str, ...]


class Checking(NamedTuple):
    """So many members have been compared with single runs, of so many."""

    done: int
    members: int


class Gathering(NamedTuple):
    """The shards are being gathered."""


Happening = Started | ShardDone | Trouble | Checking | Gathering


@dataclass(frozen=True)
class Sweep:
    """A sweep as far as it has come.

    Attributes:
        folder: Where it is.
        survey: Which shards are done.
        check: The comparison with single runs, where it was made.
        finished: Whether everything is done and gathered.
    """

    folder: SweepFolder
    survey: Survey
    check: Check | None
    finished: bool


@dataclass(frozen=True)
class Ways:
    """How a sweep is done; nothing of it shows in the results.

    Args:
        factory: Follows the members; default what belongs to the engine of the plan.
        threads: How many; default as many as there are processors.
        shard_size: Members of a shard; default that of the folder, or a good one.
        retry_failed: Compute shards with members that failed once more.
        fail_fast: Stop at the first member that failed.
        force: Move a different sweep of the same name aside.
    """

    factory: EngineFactory | None = None
    threads: int | None = None
    shard_size: int | None = None
    retry_failed: bool = False
    fail_fast: bool = False
    force: bool = False


def sweep_to_folder(
    plan: Plan,
    path: Path,
    ways: Ways | None = None,
    told: Callable[[Happening | None], None] = lambda _: None,
    stop: Event | None = None,
) -> Sweep:
    """Does what is not done yet of a sweep.

    Args:
        plan: The plan.
        path: The folder of the sweep.
        ways: How, other than by default.
        told: Called in this thread for everything that happens, and with None now and then.
        stop: May be set, by any thread, to end after the shards that are being computed.

    Raises:
        ResultExistsError: A different sweep has that name.
        FolderInUseError: Another process is at it.
        StoreError: Something cannot be written or read; EngineMissingError.
    """
    stop = stop or Event()
    ways = ways or Ways()
    factory = ways.factory or factory_for(plan.engine)
    with begun(path, plan, ways.shard_size, force=ways.force) as place:
        folder, before = place.folder, survey_of(place.folder)
        survey = before.without_failed() if ways.retry_failed else before
        check_room(plan, folder, survey.missing)
        told(Started(folder, survey, place.kept_aside, place.changed))
        threads = ways.threads or processors()
        execution = Execution(plan, folder, factory, threads, told, stop, ways.fail_fast)
        execution.run(survey)
        survey.filled_from(before)
        if survey.missing or stop.is_set():
            return Sweep(folder, survey, None, finished=False)
        digest = digest_of_shards(survey)
        check = None
        if plan.engine != ENGINE:
            check = check_of(
                plan, folder, digest, stop, lambda *count: told(Checking(*count)), threads
            )
            if check is None:
                return Sweep(folder, survey, None, finished=False)
        if not is_gathered(folder, digest):
            told(Gathering())
            gather(plan, folder, digest, check)
        return Sweep(folder, survey, check, finished=True)


def processors() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
