"""Code for the workers of a Dask cluster: compute shards and return them.

`dask_executor.py` imports it, and so do the workers that get a plan from it.
"""

from dataclasses import dataclass
from functools import cached_property
from threading import Lock, local
from typing import Any, NamedTuple

from distributed import get_worker
from distributed.diagnostics.plugin import WorkerPlugin

from rbstab.sweep.execution.compute_shard import compute_members
from rbstab.sweep.execution.machine_properties import difference, processor, versions
from rbstab.sweep.execution.work_queue import ExecutorError
from rbstab.sweep.members.engine import EngineError, EngineFactory, MemberEngine, Shard
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import Plan, plan_id


class WorkerDiffersError(ExecutorError):
    """A worker has other versions or another plan, so the bits of its results would differ."""


class Computed(NamedTuple):
    """A shard, the error of its engine if there was one, and the processor that computed it."""

    shard: Shard
    error: EngineError | None
    processor: str


@dataclass(frozen=True)
class SweepTask:
    """The data of a sweep that each worker gets.

    Args:
        plan: The plan as plain data.
        plan_id: The identity of the plan.
        engine: The name of the plan's engine.
        versions: The versions that a worker must have.
        factory: Makes engines; default the factory for the plan's engine.
        allow_python: Whether the code of users in the plan may be run, as in the process that
            sends it.
    """

    plan: dict[str, Any]
    plan_id: str
    engine: str
    versions: dict[str, str]
    factory: EngineFactory | None = None
    allow_python: bool = False


class SweepPlugin(WorkerPlugin):
    """A Dask plugin that gives a sweep to every worker, also to workers that join later.

    Args:
        task: The sweep.
    """

    def __init__(self, task: SweepTask) -> None:
        self.task = task

    def setup(self, worker: Any) -> None:
        """Prepare the worker; the plan is loaded at its first shard."""
        self._engines, self._lock = local(), Lock()

    def compute(self, start: int, stop: int) -> Computed:
        """Integrate some members with the engine of this thread."""
        errors: list[EngineError] = []

        def on_error(error: Exception) -> None:
            errors.append(EngineError.of(error))

        with self._lock:
            plan = self.plan
        shard = compute_members(plan, self._engine(plan), start, stop, on_error)
        return Computed(shard, errors[0] if errors else None, self.processor)

    def _engine(self, plan: Plan) -> MemberEngine:
        found: MemberEngine | None = getattr(self._engines, "engine", None)
        if found is None:
            found = (self.task.factory or factory_for(self.task.engine))(plan)
            self._engines.engine = found
        return found

    @cached_property
    def plan(self) -> Plan:
        """The plan, loaded from its data, and verified by its id."""
        try:
            theirs = versions(self.task.engine)
        except ImportError as error:
            raise WorkerDiffersError(f"a worker cannot compute: {error}") from error
        refuse_other_versions(self.task.versions, theirs)
        plan = load_plan(self.task.plan, allow_python=self.task.allow_python)
        if plan_id(plan) != self.task.plan_id:
            raise WorkerDiffersError(
                f"a worker loaded another plan ({plan_id(plan)[:8]}, not {self.task.plan_id[:8]})"
            )
        return plan

    @cached_property
    def processor(self) -> str:
        """The type of this worker's processor."""
        return processor()


def refuse_other_versions(ours: dict[str, str], theirs: dict[str, str], address: str = "") -> None:
    """Reject a worker whose versions differ from the versions of the process that writes.

    Raises:
        WorkerDiffersError: The versions differ.
    """
    different = difference(ours, theirs)
    if different:
        worker = f"the worker {address}" if address else "a worker"
        raise WorkerDiffersError(f"{worker} has {different}: the bits of its results would differ")


def compute(name: str, start: int, stop: int) -> Computed:
    """Integrate some members of a sweep; runs on a worker that has the plugin with this name."""
    plugin = get_worker().plugins[name]
    assert isinstance(plugin, SweepPlugin)
    return plugin.compute(start, stop)
