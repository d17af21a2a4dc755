"""A whole sweep, from its plan to its one file; or a part of it, and the joining of the parts."""

import os
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Event
from typing import NamedTuple

from rbstab.config.errors import ConfigError
from rbstab.store.errors import NotAResultError
from rbstab.sweep.execution.events import ExecutionEvent
from rbstab.sweep.execution.execute import Execution, Executor, ShardInventory, shard_inventory
from rbstab.sweep.execution.shard_process import ShardProcess
from rbstab.sweep.execution.threads import ThreadExecutor
from rbstab.sweep.folder.disk_space import check_disk_space
from rbstab.sweep.folder.gather import digest_of_shards, gather, is_gathered
from rbstab.sweep.folder.open_folder import (
    OpenFolder,
    locked_folder,
    open_for_part,
    open_for_sweep,
    remove_old_partial_files,
)
from rbstab.sweep.folder.parts import Part, forget_parts
from rbstab.sweep.folder.sweep_folder import PLAN_FILE, SweepFolder, open_folder
from rbstab.sweep.members.comparison import ENGINE, Check, check_of
from rbstab.sweep.members.engine import EngineFactory
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import Plan, plan_id


class Started(NamedTuple):
    """The folder is there, and what is done already; for the rest see `OpenFolder`.

    members is how many there are to be done in all, by this process.
    """

    folder: SweepFolder
    inventory: ShardInventory
    moved_aside: Path | None
    changed: tuple[str, ...]
    members: int


class Comparing(NamedTuple):
    """So many members have been compared with single runs, of so many."""

    done: int
    members: int


class Gathering(NamedTuple):
    """The shards are being gathered."""


SweepEvent = Started | ExecutionEvent | Comparing | Gathering


@dataclass(frozen=True)
class Sweep:
    """A sweep as far as it has come.

    Attributes:
        folder: Where it is.
        inventory: Which shards are done; of a part, its own.
        check: The comparison with single runs, where it was made.
        finished: Whether everything is done and gathered.
        part: Which part it is, where it is one.
    """

    folder: SweepFolder
    inventory: ShardInventory
    check: Check | None
    finished: bool
    part: Part | None = None


@dataclass(frozen=True)
class SweepOptions:
    """How a sweep is done; nothing of it shows in the results.

    Args:
        factory: Follows the members, in this process; default what belongs to the engine of the
            plan, of which the first is in this process and each other in one of its own.
        threads: How many follow members side by side; default as many as there are processors.
        shard_size: Members of a shard; default that of the folder, or a good one.
        retry_failed: Compute shards with members that failed once more.
        fail_fast: Stop at the first member that failed.
        force: Move a different sweep of the same name aside; not for a part.
        part: Compute this part only, and gather nothing; default all.
        executor: Computes the shards, in place of threads.

    Raises:
        ValueError: threads or shard_size is below 1.
    """

    factory: EngineFactory | None = None
    threads: int | None = None
    shard_size: int | None = None
    retry_failed: bool = False
    fail_fast: bool = False
    force: bool = False
    part: Part | None = None
    executor: Executor | None = None

    def __post_init__(self) -> None:
        """No thread would never end, and a shard of no member never begin."""
        for name, count in (("threads", self.threads), ("shard_size", self.shard_size)):
            if count is not None and count < 1:
                raise ValueError(f"{name} is {count} (expected at least 1)")


def sweep_to_folder(
    plan: Plan,
    path: Path,
    options: SweepOptions | None = None,
    on_event: Callable[[SweepEvent | None], None] = lambda _: None,
    stop: Event | None = None,
) -> Sweep:
    """Does what is not done yet of a sweep.

    Args:
        plan: The plan.
        path: The folder of the sweep.
        options: How, other than by default.
        on_event: Called in this thread for everything that happens, and with None now and then.
        stop: May be set, by any thread, to end after the shards that are being computed.

    Raises:
        ResultExistsError: A different sweep has that name.
        FolderInUseError: Another process is at it.
        StoreError: Something cannot be written or read.
        EngineMissingError: The engine cannot be used.
        ExecutorError: The executor cannot go on.
    """
    stop = stop or Event()
    options = options or SweepOptions()
    executor = options.executor or _threads(plan, options)
    with _place(path, plan, options) as place:
        folder = place.folder
        numbers = range(folder.shards) if options.part is None else options.part.of(folder.shards)
        before = shard_inventory(folder, numbers)
        inventory = before.counting_failed_as_missing() if options.retry_failed else before
        check_disk_space(plan, folder, inventory.missing)
        members = folder.members_of(numbers)
        on_event(Started(folder, inventory, place.moved_aside, place.changed, members))
        Execution(plan, folder, executor, on_event, stop, options.fail_fast).run(inventory)
        inventory.add_from(before)
        if options.part is not None or inventory.missing or stop.is_set():
            return Sweep(folder, inventory, None, finished=False, part=options.part)
        course = _Course(on_event, stop, options.threads or processors())
        return _joined(plan, folder, inventory, course)


def gather_folder(
    path: Path,
    on_event: Callable[[SweepEvent | None], None] = lambda _: None,
    stop: Event | None = None,
) -> Sweep:
    """Joins the shards of a folder, if all are there, whoever has computed them.

    Args:
        path: The folder of a sweep.
        on_event: Called in this thread for everything that happens.
        stop: May be set, by any thread, to end before all is done.

    Returns:
        The sweep; where shards are missing it is not finished.

    Raises:
        NotAResultError: It is not the folder of a sweep, or its plan is damaged.
        FolderInUseError: Somebody is computing in it.
        StoreError: Something cannot be written or read.
        EngineMissingError: The engine is not there, whose versions the file tells.
    """
    # Looked at first: no folder is made here.
    open_folder(path)
    with locked_folder(path) as sure:
        folder = open_folder(path)
        plan = _stored_plan(folder)
        inventory = shard_inventory(folder)
        on_event(Started(folder, inventory, None, (), folder.manifest.members))
        if inventory.missing:
            return Sweep(folder, inventory, None, finished=False)
        factory_for(plan.engine)
        if sure:
            remove_old_partial_files(path)
        return _joined(plan, folder, inventory, _Course(on_event, stop or Event(), processors()))


def _threads(plan: Plan, options: SweepOptions) -> ThreadExecutor:
    count = options.threads or processors()
    if options.factory is not None:
        # Whoever brings an engine may not be able to send it.
        return ThreadExecutor(options.factory, count)
    factory = factory_for(plan.engine)
    return ThreadExecutor(factory, count, partial(ShardProcess, factory=factory))


def _place(path: Path, plan: Plan, options: SweepOptions) -> AbstractContextManager[OpenFolder]:
    if options.part is not None:
        return open_for_part(path, plan, options.shard_size, options.part)
    return open_for_sweep(path, plan, options.shard_size, force=options.force)


def _stored_plan(folder: SweepFolder) -> Plan:
    """The plan that stands in a folder; it needs no other file."""
    path = folder.path / PLAN_FILE
    try:
        plan = load_plan(path)
    except ConfigError as error:
        raise NotAResultError(f"{path} is damaged: {error.problems[0]}") from error
    if plan_id(plan) != folder.manifest.plan_id:
        raise NotAResultError(f"{path} is not the plan of this folder's shards")
    return plan


class _Course(NamedTuple):
    """Who learns what happens, what ends it early, and how many processes may compare members."""

    on_event: Callable[[SweepEvent | None], None]
    stop: Event
    processes: int


def _joined(plan: Plan, folder: SweepFolder, inventory: ShardInventory, course: _Course) -> Sweep:
    """A sweep whose shards are all there: compared with single runs, and gathered."""
    on_event, stop, processes = course
    digest = digest_of_shards(inventory)
    check = None
    if plan.engine != ENGINE:
        check = check_of(
            plan, folder, digest, stop, lambda *count: on_event(Comparing(*count)), processes
        )
        if check is None:
            return Sweep(folder, inventory, None, finished=False)
    if not is_gathered(folder, digest):
        on_event(Gathering())
        gather(plan, folder, digest, check)
    forget_parts(folder.path)
    return Sweep(folder, inventory, check, finished=True)


def processors() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
