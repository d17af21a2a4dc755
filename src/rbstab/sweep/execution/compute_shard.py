"""Compute one shard, also if its engine raises an error, and write it."""

from collections.abc import Callable, Iterator

import numpy as np

from rbstab.integrate.engines import EngineMissingError
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Layout
from rbstab.sweep.execution.events import EngineFailed, ShardDone
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.engine import MemberEngine, Shard
from rbstab.sweep.members.outcome import outcome_columns
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.members.traces import checked_traces
from rbstab.sweep.plan.plan import Plan


def compute_shard(
    plan: Plan, folder: SweepFolder, number: int, engine: MemberEngine
) -> Iterator[EngineFailed | ShardDone]:
    """Integrate the members of a shard, write it, and yield the events.

    Raises:
        EngineMissingError: The engine cannot be used.
        StoreError: The shard cannot be written.
    """
    start, stop = folder.bounds(number)
    errors: list[Exception] = []
    shard = compute_members(plan, engine, start, stop, errors.append)
    yield from (EngineFailed(start, stop, error) for error in errors)
    yield store_shard(folder, number, shard)


def store_shard(folder: SweepFolder, number: int, shard: Shard) -> ShardDone:
    """Write a shard.

    Raises:
        StoreError: It cannot be written.
    """
    start, stop = folder.bounds(number)
    return ShardDone(number, stop - start, folder.write(number, shard.outcome, shard.traces))


def compute_members(
    plan: Plan,
    engine: MemberEngine,
    start: int,
    stop: int,
    on_error: Callable[[Exception], None],
) -> Shard:
    """Integrate members with an engine; if it raises an error, integrate them one by one.

    If the plan has `prove`, the convergence of the members is proved as well.

    Args:
        plan: The plan.
        engine: Integrates the members.
        start: The first member.
        stop: One after the last member, as in `range`.
        on_error: Called with the engine's error.

    Raises:
        EngineMissingError: The engine cannot be used.
    """
    try:
        shard = _computed(plan, engine, start, stop)
    except EngineMissingError:
        raise
    except Exception as error:
        # No member may stop the sweep: each is rerun as a single run, and gets its own status.
        on_error(error)
        shard = _computed(plan, SingleRuns(plan), start, stop)
    if plan.prove is None:
        return shard
    # Imported late: only plans with `prove` enclose motions.
    from rbstab.sweep.proofs.motions import motion_columns

    return Shard(shard.outcome | motion_columns(plan, start, stop), shard.traces)


def _computed(plan: Plan, engine: MemberEngine, start: int, stop: int) -> Shard:
    shard = engine.compute(start, stop)
    traces = checked_traces(shard.traces, plan, start, stop)
    return Shard(checked_columns(shard, stop - start, outcome_columns(plan)), traces)


def checked_columns(shard: Shard, members: int, columns: Layout) -> dict[str, Array]:
    """Check the columns of a shard, and return them in their types.

    Raises:
        ValueError: A column is missing, or does not have one entry for each member.
    """
    found = {}
    for name, column in columns.items():
        data = np.asarray(shard.outcome.get(name))
        if data.shape != (members, *column.shape):
            raise ValueError(f"{name} has the shape {data.shape} for {members} members")
        found[name] = data.astype(column.dtype, copy=False)
    return found
