"""Run a sweep, or one part of it, and finish it when all its shards are stored."""

from dataclasses import dataclass
from pathlib import Path
from threading import Event
from time import monotonic

import numpy as np

from rbstab.processes.processors import processor_count
from rbstab.store.disk.atomic import remove_all_abandoned
from rbstab.store.disk.paths import check_writable
from rbstab.sweep.execution.events import Comparing, EventCallback, Finishing, Started
from rbstab.sweep.execution.pools import Pool, Processes, Threads
from rbstab.sweep.execution.run import ShardRun
from rbstab.sweep.folder.members_file import (
    digest_of_shards,
    is_finished,
    members_of_shards,
    write_members_file,
)
from rbstab.sweep.folder.open_folder import (
    WHOLE,
    Part,
    check_disk_space,
    locked_folder,
    open_folder,
)
from rbstab.sweep.folder.scipy_comparison import (
    ENGINE,
    ScipyComparison,
    compare_with_scipy,
    comparison_of,
)
from rbstab.sweep.folder.shard_inventory import ShardInventory, shard_inventory
from rbstab.sweep.folder.sweep_folder import SHARDS, TRACES, SweepFolder
from rbstab.sweep.folder.sweep_table import read_members_file, read_sweep
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.bodies import Bodies, bodies_of
from rbstab.sweep.proofs.boxes import prove_boxes
from rbstab.sweep.proofs.columns import CONVERGENCE_COLUMNS
from rbstab.sweep.proofs.convergence import (
    PROOF_COLUMNS,
    MemberConvergence,
    ProvedConvergence,
    convergence_now,
    keep_proofs,
    stored_convergence,
)
from rbstab.sweep.proofs.prove_bodies import BUDGET, FEW, BodyProofs, Progress, prove_bodies
from rbstab.sweep.proofs.sole_state import sole_state_of


@dataclass(frozen=True)
class Sweep:
    """The state of a sweep.

    Attributes:
        folder: The folder of the sweep.
        inventory: The stored and the missing shards; for a part, only the shards of this part.
        comparison: The comparison with SciPy, if it was made.
        finished: Whether all shards and the members file are stored.
        part: The part, if only one part was run.
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
    """Run the missing shards of a sweep; when all are stored, write the members file.

    Args:
        plan: The plan.
        path: The folder of the sweep.
        options: How to run the sweep.
        on_event: Called in this thread with each event, and with None when idle.
        stop: Any thread may set it; then the sweep ends after the shards that are being computed.

    Raises:
        ResultExistsError: The folder holds something else, such as a different sweep.
        FolderInUseError: Another command runs in the folder, and one of the two must be alone.
        StoreError: A file cannot be written or read.
        EngineMissingError: The engine cannot be used.
        ExecutorError: The executor cannot continue.
    """
    stop = stop or Event()
    options = options or SweepOptions()
    alone = options.force or options.retry_failed
    with open_folder(path, plan, options.shard_size, force=options.force, alone=alone) as opened:
        folder = opened.folder
        numbers = (options.part or WHOLE).shard_numbers(folder.shards)
        inventory = shard_inventory(folder, numbers, read_traces=True)
        retried = {}
        if options.retry_failed:
            failed = [k for k, facts in inventory.done.items() if facts.first_failed is not None]
            retried = {k: inventory.done.pop(k) for k in failed}
            inventory.missing = sorted([*inventory.missing, *failed])
        if inventory.missing:
            check_writable(folder.shard_file(inventory.missing[0]))
        check_disk_space(plan, folder, inventory.missing)
        if plan.prove is not None:
            keep_proofs(plan, path.parent)
        members = folder.members_of(numbers)
        on_event(Started(folder, inventory, opened.moved_aside, opened.changed, members))
        factory = options.factory
        if options.pool is None:
            factory = factory or factory_for(plan.engine)
        ShardRun(
            plan,
            folder,
            _pools(options, len(inventory.missing)),
            on_event,
            stop,
            options.fail_fast,
            factory,
        ).compute(inventory)
        # What was not computed again is stored as it was.
        inventory.done = retried | inventory.done
        inventory.missing = [k for k in inventory.missing if k not in inventory.done]
        if options.part is not None or inventory.missing or stop.is_set():
            return Sweep(folder, inventory, None, finished=False, part=options.part)
        return _finish(plan, folder, inventory, options.compare, on_event, stop)


def _pools(options: SweepOptions, shards: int) -> list[Pool]:
    """Return where the members are computed: at once in this process, soon in others beside it."""
    if options.pool is not None:
        return [options.pool]
    count = max(1, min(options.threads or processor_count(), shards))
    if options.factory is not None or count == 1:
        # A factory of the caller may not be picklable, so all threads compute in this process.
        return [Threads(count)]
    return [Threads(), Processes(count - 1)]


def prove_members(  # noqa: PLR0913 (options by name)
    plan: Plan,
    sweep: Sweep,
    *,
    bodies: Bodies | None = None,
    budget: float | None = BUDGET,
    processes: int = 1,
    progress: Progress = lambda _reached, _all: None,
    stop: Event | None = None,
) -> BodyProofs:
    """Prove the rest states of each distinct body of a finished sweep, and store what follows.

    If there are more than `FEW` bodies, it is first tried to prove many at once (`boxes`). This
    takes some seconds, and covers bodies that the budget does not reach.

    The columns `convergence`, `proved_rest_state` and `one_rest_state` of the sweep's file say it
    of each member.

    Args:
        plan: The plan.
        sweep: The sweep.
        bodies: Its distinct bodies, if they are known.
        budget: The time for all proofs, s; None: no limit.
        processes: The largest number of worker processes.
        progress: Called after each body with the number of those that were reached, and of all.
        stop: Set by an interrupt; what was proved until then is stored.

    Raises:
        FolderInUseError: Another command runs in the folder, and one of the two must be alone.
        StoreError: A file cannot be written or read.
    """
    folder = sweep.folder
    results, begin = folder.path.parent, monotonic()
    with locked_folder(folder.path):
        stored = _stored(folder)
        bodies, convergence = bodies_of(plan) if bodies is None else bodies, stored
        boxes = prove_boxes(plan, results, stop=stop) if len(bodies) > FEW else []
        if any(box.record.proved for box in boxes):
            table = read_sweep(folder.sweep_file, PROOF_COLUMNS)
            convergence = convergence_now(table, ProvedConvergence(plan, results))
        proofs = prove_bodies(
            *(plan, results, convergence),
            bodies=bodies,
            budget=None if budget is None else budget - (monotonic() - begin),
            processes=processes,
            progress=progress,
            stop=stop,
        )
        now = sole_state_of(ProvedConvergence(plan, results), proofs.convergence)
        seconds = monotonic() - begin
        proofs = proofs._replace(budget=budget, seconds=seconds, boxes=boxes, sole_state=now)
        if not all(map(np.array_equal, proofs.convergence, stored)):
            _write_convergence(plan, sweep, proofs.convergence)
    return proofs


def store_convergence(plan: Plan, sweep: Sweep, shared: ProvedConvergence) -> MemberConvergence:
    """Write into the file of a sweep what the proofs that its members share say of each of them.

    Args:
        plan: The plan.
        sweep: The sweep.
        shared: The proofs.

    Returns:
        What is proved of the members, these proofs and earlier ones together.

    Raises:
        FolderInUseError: Another command runs in the folder, and one of the two must be alone.
        StoreError: A file cannot be written or read.
    """
    stored = _stored(sweep.folder)
    convergence = shared.of(0, plan.members).beside(stored)
    if not np.array_equal(convergence.codes, stored.codes):
        with locked_folder(sweep.folder.path):
            _write_convergence(plan, sweep, convergence)
    return convergence


def _stored(folder: SweepFolder) -> MemberConvergence:
    """Return what the members file says of convergence."""
    return stored_convergence(read_members_file(folder, CONVERGENCE_COLUMNS))


def _write_convergence(plan: Plan, sweep: Sweep, convergence: MemberConvergence) -> None:
    """Store what is found, beside what another command has stored in the meantime."""
    convergence, digest = (
        convergence.beside(_stored(sweep.folder)),
        digest_of_shards(sweep.inventory),
    )
    write_members_file(plan, sweep.folder, digest, sweep.comparison, convergence)


def _finish(  # noqa: PLR0913, PLR0917 (a sweep, and how its end is told)
    plan: Plan,
    folder: SweepFolder,
    inventory: ShardInventory,
    compare: int | None,
    on_event: EventCallback,
    stop: Event,
) -> Sweep:
    """Compare members with SciPy, and write the members file. All shards must be stored."""

    def progress(done: int, members: int) -> bool:
        on_event(Comparing(done, members))
        return not stop.is_set()

    digest = digest_of_shards(inventory)
    before = members_of_shards(folder, digest)
    finished = is_finished(folder, before)
    if not finished:
        check_writable(folder.sweep_file)
    comparison = None
    if plan.engine != ENGINE:
        kept = comparison_of(folder, before)
        comparison = compare_with_scipy(plan, folder, compare, kept, progress)
        if comparison is None:
            return Sweep(folder, inventory, None, finished=False)
        finished = finished and comparison == kept
    if not finished:
        on_event(Finishing())
        convergence = None if before is None else stored_convergence(before)
        write_members_file(plan, folder, digest, comparison, convergence)
    for inner in (folder.path, folder.path / SHARDS, folder.path / TRACES):
        remove_all_abandoned(inner)
    return Sweep(folder, inventory, comparison, finished=True)
