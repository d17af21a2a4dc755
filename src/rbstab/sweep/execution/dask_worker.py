"""What a worker of a Dask cluster does of a sweep: it computes shards, and hands them back.

Only `dask_execution.py`, and a worker that it has sent a plan to, imports this.
"""

from dataclasses import dataclass
from functools import cached_property
from threading import Lock, local
from typing import Any, NamedTuple

from distributed import get_worker
from distributed.diagnostics.plugin import WorkerPlugin

from rbstab.sweep.execution.compute_shard import computed
from rbstab.sweep.execution.execute import ExecutorError
from rbstab.sweep.execution.machine_properties import difference, processor, versions
from rbstab.sweep.members.engine import EngineError, EngineFactory, MemberEngine, Shard
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import Plan, plan_id


class WorkerDiffersError(ExecutorError):
    """What a worker computes would have other bits than what the others do."""


class Computed(NamedTuple):
    """A shard, what the engine raised on it (or nothing), and on which processor it was made."""

    shard: Shard
    trouble: EngineError | None
    processor: str


@dataclass(frozen=True)
class Order:
    """What every worker has to know once.

    Args:
        plan: As plain data.
        plan_id: Of the plan.
        engine: Of the plan.
        versions: That a worker must have.
        factory: Makes engines; default what belongs to the engine.
    """

    plan: dict[str, Any]
    plan_id: str
    engine: str
    versions: dict[str, str]
    factory: EngineFactory | None = None


class SweepPlugin(WorkerPlugin):
    """Brings an order to every worker there is, and to those that come later.

    Args:
        order: The order.
    """

    def __init__(self, order: Order) -> None:
        self.order = order

    def setup(self, worker: Any) -> None:
        """Takes the order; all that takes time waits for the first shard."""
        self._engines, self._lock = local(), Lock()

    def compute(self, start: int, stop: int) -> Computed:
        """Some members, by the engine of this thread."""
        troubles: list[EngineError] = []

        def troubled(error: Exception) -> None:
            troubles.append(EngineError.of(error))

        with self._lock:
            plan = self.plan
        shard = computed(plan, self._engine(plan), start, stop, troubled)
        return Computed(shard, troubles[0] if troubles else None, self.processor)

    def _engine(self, plan: Plan) -> MemberEngine:
        found: MemberEngine | None = getattr(self._engines, "engine", None)
        if found is None:
            found = (self.order.factory or factory_for(self.order.engine))(plan)
            self._engines.engine = found
        return found

    @cached_property
    def plan(self) -> Plan:
        """The plan, loaded again here, if it is the same one."""
        try:
            theirs = versions(self.order.engine)
        except ImportError as error:
            raise WorkerDiffersError(f"a worker cannot compute: {error}") from error
        refuse_other_versions(self.order.versions, theirs)
        plan = load_plan(self.order.plan)
        if plan_id(plan) != self.order.plan_id:
            raise WorkerDiffersError(
                f"a worker reads another plan ({plan_id(plan)[:8]}, not {self.order.plan_id[:8]})"
            )
        return plan

    @cached_property
    def processor(self) -> str:
        """The kind of this worker's processor."""
        return processor()


def refuse_other_versions(ours: dict[str, str], theirs: dict[str, str], where: str = "") -> None:
    """Refuses a worker that has not the versions of the process that writes.

    Raises:
        WorkerDiffersError: It has not.
    """
    different = difference(ours, theirs)
    if different:
        who = f"the worker {where}" if where else "a worker"
        raise WorkerDiffersError(f"{who} has {different}: its results would have other bits")


def compute(name: str, start: int, stop: int) -> Computed:
    """Some members of an ordered plan, on the worker that runs this."""
    plugin = get_worker().plugins[name]
    assert isinstance(plugin, SweepPlugin)
    return plugin.compute(start, stop)
