"""One shard: its members are followed, whatever their engine does, and it is written."""

from collections.abc import Callable, Iterator

import numpy as np

from rbstab.integrate.engines import EngineMissingError
from rbstab.mechanics.numbers import Array
from rbstab.sweep.execution.events import EngineFailed, ShardDone
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.engine import MemberEngine, Shard
from rbstab.sweep.members.outcome import COLUMNS
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.members.traces import checked_traces
from rbstab.sweep.plan.plan import Plan


def compute_shard(
    plan: Plan, folder: SweepFolder, number: int, engine: MemberEngine
) -> Iterator[EngineFailed | ShardDone]:
    """Follows the members of a shard, writes it, and tells what happens.

    Raises:
        EngineMissingError: The engine cannot be used.
        StoreError: The shard cannot be written.
    """
    start, stop = folder.bounds(number)
    troubles: list[Exception] = []
    shard = computed(plan, engine, start, stop, troubles.append)
    yield from (EngineFailed(start, stop, error) for error in troubles)
    yield written(folder, number, shard)


def written(folder: SweepFolder, number: int, shard: Shard) -> ShardDone:
    """Writes a shard.

    Raises:
        StoreError: It cannot be written.
    """
    start, stop = folder.bounds(number)
    return ShardDone(number, stop - start, folder.write(number, shard.outcome, shard.traces))


def computed(
    plan: Plan,
    engine: MemberEngine,
    start: int,
    stop: int,
    troubled: Callable[[Exception], None],
) -> Shard:
    """A shard, by an engine or, where that raises an error, member by member.

    Args:
        plan: The plan.
        engine: Follows the members.
        start: The first one.
        stop: Behind the last one.
        troubled: Called with the engine's error.

    Raises:
        EngineMissingError: The engine cannot be used.
    """
    try:
        return _checked(plan, engine, start, stop)
    except EngineMissingError:
        raise
    except Exception as error:
        # No member may end the sweep: they are followed alone, each with a status of its own.
        troubled(error)
        return _checked(plan, SingleRuns(plan), start, stop)


def _checked(plan: Plan, engine: MemberEngine, start: int, stop: int) -> Shard:
    shard = engine.compute(start, stop)
    traces = checked_traces(shard.traces, plan, start, stop)
    return Shard(checked(shard, stop - start), traces)


def checked(shard: Shard, members: int) -> dict[str, Array]:
    """The columns of a shard in their types.

    Raises:
        ValueError: A column is missing, or has not an entry for each member.
    """
    found = {}
    for column in COLUMNS:
        data = np.asarray(shard.outcome.get(column.name))
        if data.shape != (members, *column.shape):
            raise ValueError(f"{column.name} has the shape {data.shape} for {members} members")
        found[column.name] = data.astype(column.dtype, copy=False)
    return found
