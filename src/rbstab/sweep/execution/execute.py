"""Run the missing shards of a sweep.

With equal versions and processors, the content of a shard depends only on the plan. So the results
do not depend on the worker that computes the shard, or on interruptions.
"""

from collections import deque
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, field
from threading import Event

from rbstab.sweep.execution.events import ExecutionEvent, ShardDone
from rbstab.sweep.execution.work_queue import Executor, WorkQueue
from rbstab.sweep.folder.shard_inventory import ShardInventory
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.plan.plan import Plan


@dataclass
class Execution:
    """The execution of a sweep.

    Args:
        plan: The plan.
        folder: The folder of the sweep; the caller holds its lock.
        executor: Computes the shards.
        on_event: Called with each event, and with None when idle.
        stop: Any thread may set it; then no further shard is started.
        fail_fast: Stop at the first member that failed.
    """

    plan: Plan
    folder: SweepFolder
    executor: Executor
    on_event: Callable[[ExecutionEvent | None], None] = lambda _: None
    stop: Event = field(default_factory=Event)
    fail_fast: bool = False

    def run(self, inventory: ShardInventory) -> None:
        """Compute the missing shards, and add them to the inventory.

        Args:
            inventory: The inventory of the folder; it is updated.

        Raises:
            StoreError: A shard cannot be written.
            EngineMissingError: An engine cannot be used.
            ExecutorError: The executor cannot continue.
        """
        if self.fail_fast and inventory.first_failed is not None:
            return
        missing = deque(sorted(inventory.missing))
        queue = WorkQueue(self.plan, self.folder, missing, self.stop, self.fail_fast)
        with closing(self.executor.events(queue)) as events:
            for event in events:
                if isinstance(event, ShardDone):
                    inventory.done[event.number] = event.facts
                self.on_event(event)
        inventory.missing = [k for k in inventory.missing if k not in inventory.done]
