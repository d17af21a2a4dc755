"""Compute members of a plan: in this process, or on a worker of any executor.

The bits of a member depend on the plan, the versions and the kind of processor alone. So a worker
that was not started from this installation compares them before its first members.
"""

import platform
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from secrets import token_hex
from threading import Lock, local
from typing import Any, NamedTuple, Self

import numpy as np

from rbstab.integrate.engines import EngineMissingError
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Layout
from rbstab.sweep.execution.machine_properties import difference, processor, versions
from rbstab.sweep.members.engine import EngineFactory, MemberEngine, Shard, columns_of_failed
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.members.outcome import STATUSES, columns_of, outcome_columns
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.members.traces import TIME, checked_traces, layout_of
from rbstab.sweep.plan.dump import plan_data
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import Plan, plan_id


class ExecutorError(Exception):
    """The members cannot be computed where they should be; stored shards are kept."""


class WorkerDiffersError(ExecutorError):
    """A worker has other versions or another plan, so the bits of its results would differ."""


class Computed(NamedTuple):
    """Computed members.

    Args:
        shard: Their results.
        error: The error of the engine, if they were then integrated one by one.
        processor: The kind of processor that computed them.
    """

    shard: Shard
    error: str
    processor: str


class Computing:
    """Computes members in this process, with an engine for each thread.

    Args:
        plan: The plan.
        factory: Makes the engines; default those of the plan.
    """

    def __init__(self, plan: Plan, factory: EngineFactory | None = None) -> None:
        self._plan = plan
        self._factory = factory or factory_for(plan.engine)
        self._own = local()
        self._processor = processor()

    def engine(self) -> MemberEngine:
        """Return the engine of this thread."""
        if not hasattr(self._own, "engine"):
            self._own.engine = self._factory(self._plan)
        engine: MemberEngine = self._own.engine
        return engine

    def __call__(self, start: int, stop: int) -> Computed:
        """Integrate the members from number `start` up to `stop`."""
        errors: list[Exception] = []
        shard = compute_members(self._plan, self.engine(), start, stop, errors.append)
        error = "".join(f"{type(error).__name__}: {error}" for error in errors)
        return Computed(shard, error, self._processor)


@dataclass(frozen=True)
class Task:
    """The same on a worker: all that it needs, as plain data. Tasks with equal names are equal.

    Args:
        name: The name of the sweep.
        plan: The plan.
        plan_id: The identity of the plan.
        engine: The engine of the plan.
        versions: The versions that the worker must have; empty if it has those of this process.
        factory: Makes the engines; default those of the plan.
        allow_python: Whether the code of users in the plan may be run, as in this process.
    """

    name: str
    plan: dict[str, Any] = field(compare=False)
    plan_id: str = field(compare=False)
    engine: str = field(compare=False)
    versions: dict[str, str] = field(compare=False)
    factory: EngineFactory | None = field(compare=False)
    allow_python: bool = field(compare=False)

    @classmethod
    def of(cls, plan: Plan, factory: EngineFactory | None, *, elsewhere: bool) -> Self:
        """Return the task of a sweep; elsewhere: the worker may have another installation."""
        known = versions(plan.engine) if elsewhere else {}
        data = plan_data(plan), plan_id(plan), plan.engine
        return cls(token_hex(8), *data, known, factory, plan.may_run_code)

    def make_engine(self) -> None:
        """Make the engine of this thread before its first members."""
        self._computing().engine()

    def __call__(self, start: int, stop: int) -> Computed:
        """Integrate the members from number `start` up to `stop`.

        Raises:
            WorkerDiffersError: This worker has other versions, or loads another plan.
        """
        return self._computing()(start, stop)

    def _computing(self) -> Computing:
        with _LOCK:
            return _loaded(self)


def refuse_other_versions(ours: dict[str, str], theirs: dict[str, str], worker: str) -> None:
    """Refuse a worker whose versions differ from those of the process that writes.

    Raises:
        WorkerDiffersError: The versions differ.
    """
    if different := difference(ours, theirs):
        raise WorkerDiffersError(
            f"the worker {worker} has {different}: the bits of its results would differ"
        )


_LOCK = Lock()
"""Held while a plan is loaded, so that the threads of a worker load it once."""


@lru_cache(maxsize=4)
def _loaded(task: Task) -> Computing:
    """Compare this worker with the sender, once, and load the plan."""
    if task.versions:
        try:
            refuse_other_versions(task.versions, versions(task.engine), platform.node())
        except ImportError as error:
            raise WorkerDiffersError(f"a worker cannot compute: {error}") from error
    plan = load_plan(task.plan, allow_python=task.allow_python)
    if plan_id(plan) != task.plan_id:
        raise WorkerDiffersError(
            f"a worker loaded another plan ({plan_id(plan)[:8]}, not {task.plan_id[:8]})"
        )
    return Computing(plan, task.factory)


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
        shard = _checked(plan, engine, start, stop)
    except EngineMissingError:
        raise
    except Exception as error:
        # No member may stop the sweep: each is rerun as a single run, and gets its own status.
        on_error(error)
        shard = _checked(plan, SingleRuns(plan), start, stop)
    if plan.prove is None:
        return shard
    # Imported late: only plans with `prove` enclose motions.
    from rbstab.sweep.proofs.motions import motion_columns

    return Shard(shard.outcome | motion_columns(plan, start, stop), shard.traces)


def crashed_member(plan: Plan, member: int) -> Shard:
    """Return the results of a member that ends every process that computes it."""
    outcome = columns_of_failed(1, columns_of(plan))
    outcome["status"][:] = STATUSES.index(RunStatus.CRASHED)
    is_kept = plan.keep.selected(member, member + 1).any()
    return Shard(outcome, layout_of(plan).empty(1) if is_kept else None)


def joined(shards: list[Shard]) -> Shard:
    """Return consecutive members as one shard."""
    outcome = _joined([shard.outcome for shard in shards])
    traces = [shard.traces for shard in shards if shard.traces is not None]
    return Shard(outcome, _joined(traces) | {TIME: traces[0][TIME]} if traces else None)


def _joined(parts: list[dict[str, Array]]) -> dict[str, Array]:
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _checked(plan: Plan, engine: MemberEngine, start: int, stop: int) -> Shard:
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
