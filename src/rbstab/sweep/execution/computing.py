"""Compute members of a plan: in this process, or on a worker of any executor.

The bits of a member depend on the plan, the versions and the kind of processor alone. So a worker
that was not started from this installation compares them before its first members.
"""

import hashlib
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from secrets import token_hex
from threading import Lock, local
from typing import Any, NamedTuple, Self

from rbstab.experiment.provenance import PACKAGES, commit
from rbstab.integrate.engines import EngineMissingError
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.sweep.members.engine import (
    EngineFactory,
    MemberEngine,
    Shard,
    concatenated,
    failed_shard,
)
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.members.outcome import STATUSES, columns_of
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.members.traces import TIME
from rbstab.sweep.plan.load import load_plan, plan_data
from rbstab.sweep.plan.plan import Plan, plan_id

CPU_INFO = Path("/proc/cpuinfo")


class ExecutorError(Exception):
    """The members cannot be computed where they should be; stored shards are kept."""


class ChangedOnTheWayError(Exception):
    """Results are not those that the worker sent."""


class WorkerDiffersError(ExecutorError):
    """A worker has other versions or another plan, so the bits of its results would differ."""


def versions(engine: str) -> dict[str, str]:
    """Return the versions of rbstab and of all packages that affect the results of an engine."""
    names = sorted({*PACKAGES[engine], *PACKAGES["scipy"]})
    program = {"rbstab": version("rbstab"), "its commit": commit()}
    return program | {name: import_module(name).__version__ for name in names}


def difference(expected: dict[str, str], actual: dict[str, str]) -> str:
    """Return the versions that differ, as text; an empty text if all are equal.

    If rbstab was installed from a package, it has no commit, and commits are not compared.
    """
    return ", ".join(
        f"{name} {actual.get(name, '?')}, not {expected[name]}"
        for name in expected
        if expected[name] != actual.get(name) and expected[name] and actual.get(name, "?")
    )


def processor() -> str:
    """Return the name of this machine's processor type."""
    try:
        lines = CPU_INFO.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, "") or platform.processor() or platform.machine()


class Computed(NamedTuple):
    """Computed members.

    Args:
        shard: Their results.
        error: The error of the engine, if they were then integrated one by one.
        processor: The kind of processor that computed them.
        digest: The digest of the columns, made where they were computed. Traces have none: theirs
            would take a fifth of the time to compute them.
    """

    shard: Shard
    error: str
    processor: str
    digest: str


def digest_of(columns: Mapping[str, Array]) -> str:
    """Return the digest of the names, types, shapes and bytes of columns."""
    content = hashlib.sha256()
    for name, column in columns.items():
        content.update(f"{name} {column.dtype.str} {column.shape}\n".encode())
        content.update(column.tobytes())
    return content.hexdigest()


class Computing:
    """Computes members in this process, with an engine for each thread.

    Args:
        plan: The plan.
        factory: Makes the engines; default those of the plan.
    """

    def __init__(self, plan: Plan, factory: EngineFactory | None = None) -> None:
        self._plan = plan
        self._factory = factory or factory_for(plan.engine)
        self._local = local()
        self._processor = processor()

    def engine(self) -> MemberEngine:
        """Return the engine of this thread."""
        if not hasattr(self._local, "engine"):
            self._local.engine = self._factory(self._plan)
        engine: MemberEngine = self._local.engine
        return engine

    def __call__(self, start: int, stop: int) -> Computed:
        """Integrate the members from number `start` up to `stop`.

        If the engine raises an error, each member is integrated alone, and gets its own status. If
        the plan has `prove`, the convergence of the members is proved as well.

        Raises:
            EngineMissingError: The engine cannot be used.
        """
        engine, error = self.engine(), ""
        try:
            shard = engine.compute(start, stop)
        except EngineMissingError:
            raise
        except Exception as raised:
            error = f"{type(raised).__name__}: {raised}"
            shard = SingleRuns(self._plan).compute(start, stop)
        if self._plan.prove is not None:
            # Imported late: only plans with `prove` enclose motions.
            from rbstab.sweep.proofs.motions import motion_columns

            shard = Shard(shard.outcome | motion_columns(self._plan, start, stop), shard.traces)
        return Computed(shard, error, self._processor, digest_of(shard.outcome))


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
        """Return the task of a sweep.

        Args:
            plan: The plan.
            factory: Makes the engines; None: those of the plan.
            elsewhere: Whether the worker may have another installation.
        """
        required = versions(plan.engine) if elsewhere else {}
        data = plan_data(plan), plan_id(plan), plan.engine
        return cls(token_hex(8), *data, required, factory, plan.may_run_code)

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


def refuse_other_versions(expected: dict[str, str], actual: dict[str, str], worker: str) -> None:
    """Refuse a worker whose versions differ from those of the process that writes.

    Args:
        expected: The versions of the process that writes, by package.
        actual: Those of the worker.
        worker: The name of the worker.

    Raises:
        WorkerDiffersError: The versions differ.
    """
    if different := difference(expected, actual):
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


def crashed_member(plan: Plan, member: int) -> Shard:
    """Return the results of a member that ends every process that computes it."""
    shard = failed_shard(plan, member, member + 1, columns_of(plan))
    shard.outcome["status"][:] = STATUSES.index(RunStatus.CRASHED)
    return shard


def joined(shards: list[Shard]) -> Shard:
    """Return consecutive members as one shard."""
    outcome = concatenated([shard.outcome for shard in shards])
    traces = [shard.traces for shard in shards if shard.traces is not None]
    return Shard(outcome, concatenated(traces) | {TIME: traces[0][TIME]} if traces else None)
