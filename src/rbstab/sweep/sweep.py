"""Run a whole sweep, from its plan to its one file; or run one part, and join the parts."""

from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Event
from typing import NamedTuple

from rbstab.config.errors import ConfigError
from rbstab.processes.processors import processor_count
from rbstab.store.errors import NotAResultError
from rbstab.sweep.execution.compare_with_scipy import compare_with_scipy
from rbstab.sweep.execution.events import Comparing, EventCallback, Gathering, Started
from rbstab.sweep.execution.execute import Execution
from rbstab.sweep.execution.shard_worker import ShardWorker
from rbstab.sweep.execution.thread_executor import ThreadExecutor
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
from rbstab.sweep.folder.shard_inventory import ShardInventory, shard_inventory
from rbstab.sweep.folder.sweep_folder import PLAN_FILE, SweepFolder, read_folder
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.members.scipy_comparison import ENGINE, ScipyComparison
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import Plan, plan_id


@dataclass(frozen=True)
class Sweep:
    """The state of a sweep.

    Attributes:
        folder: Where it is stored.
        inventory: Which shards are stored; of a part, its own.
        comparison: The comparison with SciPy, where it was made.
        finished: Whether all shards are stored and gathered.
        part: Which part it is, if it is one.
    """

    folder: SweepFolder
    inventory: ShardInventory
    comparison: ScipyComparison | None
    finished: bool
    part: Part | None = None


def sweep_to_folder(
    plan: Plan,
    path: Path,
    options: SweepOptions | None = None,
    on_event: EventCallback = lambda _: None,
    stop: Event | None = None,
) -> Sweep:
    """Run the missing shards of a sweep; when all are stored, gather them.

    Args:
        plan: The plan.
        path: The folder of the sweep.
        options: How it is run.
        on_event: Called in this thread with each event, and with None when idle.
        stop: Any thread may set it; the sweep ends after the shards that are being computed.

    Raises:
        ResultExistsError: A different sweep has that name.
        FolderInUseError: Another process is writing to the folder.
        StoreError: A file cannot be written or read.
        EngineMissingError: The engine cannot be used.
        ExecutorError: The executor cannot go on.
    """
    stop = stop or Event()
    options = options or SweepOptions()
    executor = options.executor or _thread_executor(plan, options)
    with _opened(path, plan, options) as opened:
        folder = opened.folder
        numbers = range(folder.shards) if options.part is None else options.part.of(folder.shards)
        before = shard_inventory(folder, numbers)
        inventory = before.counting_failed_as_missing() if options.retry_failed else before
        check_disk_space(plan, folder, inventory.missing)
        members = folder.members_of(numbers)
        on_event(Started(folder, inventory, opened.moved_aside, opened.changed_versions, members))
        Execution(plan, folder, executor, on_event, stop, options.fail_fast).run(inventory)
        inventory.add_from(before)
        if options.part is not None or inventory.missing or stop.is_set():
            return Sweep(folder, inventory, None, finished=False, part=options.part)
        control = _Control(on_event, stop, options.threads or processor_count())
        return _finish(plan, folder, inventory, control)


def gather_folder(
    path: Path, on_event: EventCallback = lambda _: None, stop: Event | None = None
) -> Sweep:
    """Gather the shards of a folder in one file, if all are stored.

    Args:
        path: The folder of a sweep.
        on_event: Called in this thread with each event.
        stop: Any thread may set it to end early.

    Returns:
        The sweep; where shards are missing it is not finished.

    Raises:
        NotAResultError: It is not the folder of a sweep, or its plan is damaged.
        FolderInUseError: Another process is writing to the folder.
        StoreError: A file cannot be written or read.
        EngineMissingError: The engine, whose version the file states, is not installed.
    """
    # Before the lock, which would make a folder where there is none.
    read_folder(path)
    with locked_folder(path) as sure:
        folder = read_folder(path)
        plan = _stored_plan(folder)
        inventory = shard_inventory(folder)
        on_event(Started(folder, inventory, None, (), folder.manifest.members))
        if inventory.missing:
            return Sweep(folder, inventory, None, finished=False)
        factory_for(plan.engine)
        if sure:
            remove_old_partial_files(path)
        control = _Control(on_event, stop or Event(), processor_count())
        return _finish(plan, folder, inventory, control)


def _thread_executor(plan: Plan, options: SweepOptions) -> ThreadExecutor:
    count = options.threads or processor_count()
    if options.factory is not None:
        # A factory of the caller's own may not be one that can be sent to another process.
        return ThreadExecutor(options.factory, count)
    factory = factory_for(plan.engine)
    return ThreadExecutor(factory, count, partial(ShardWorker, factory=factory))


def _opened(path: Path, plan: Plan, options: SweepOptions) -> AbstractContextManager[OpenFolder]:
    if options.part is not None:
        return open_for_part(path, plan, options.shard_size, options.part)
    return open_for_sweep(path, plan, options.shard_size, force=options.force)


def _stored_plan(folder: SweepFolder) -> Plan:
    """The plan in a folder; it needs no other file."""
    path = folder.path / PLAN_FILE
    try:
        plan = load_plan(path)
    except ConfigError as error:
        raise NotAResultError(f"{path} is damaged: {error.problems[0]}") from error
    if plan_id(plan) != folder.manifest.plan_id:
        raise NotAResultError(f"{path} is not the plan of this folder's shards")
    return plan


class _Control(NamedTuple):
    """How the last steps of a sweep are reported and stopped, and how many processes they use."""

    on_event: EventCallback
    stop: Event
    processes: int


def _finish(plan: Plan, folder: SweepFolder, inventory: ShardInventory, control: _Control) -> Sweep:
    """Compare the members of a sweep with SciPy, and gather its shards, all of which are stored."""
    on_event, stop, processes = control
    digest = digest_of_shards(inventory)
    comparison = None
    if plan.engine != ENGINE:

        def on_compared(done: int, members: int) -> None:
            on_event(Comparing(done, members))

        comparison = compare_with_scipy(plan, folder, digest, stop, on_compared, processes)
        if comparison is None:
            return Sweep(folder, inventory, None, finished=False)
    if not is_gathered(folder, digest):
        on_event(Gathering())
        gather(plan, folder, digest, comparison)
    forget_parts(folder.path)
    return Sweep(folder, inventory, comparison, finished=True)
